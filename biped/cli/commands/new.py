"""`biped new`: files to start from."""

import argparse
import os
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path

from biped.base.errors import InputError
from biped.base.files import folder
from biped.base.writing import reason, write_text
from biped.cli.common import DONE
from biped.cli.parser import Commands, command_parser

START = "biped.control.planar.start_law"
"""The module that is written; nothing of it is run here."""
NAMED = "my_law.py"
"""Names in the written files that stand for the user's own."""
POLICY, CALLED = "biped.control.start_policy", "my_policy"
"""The same of a policy in Python, beside its card."""


def add(commands: Commands) -> None:
    """Adds the parser of `biped new`."""
    parser = command_parser(
        commands, "new", "write files to start from", command,
        description="Writes files to start from. controller: the thesis's law for a planar biped, in readable "
        "Python. policy: a card with a small network for Unitree's H1, and the same in 40 lines of Python.",
    )  # fmt: skip
    parser.add_argument("what", choices=["controller", "policy"], help="the kind of file")
    file = (
        "the file to write: my_law.py of a controller, the card my_policy.toml of a policy; files that exist are kept"
    )
    parser.add_argument("file", type=Path, help=file)


def command(args: argparse.Namespace) -> int:
    """Writes them and says how to run them."""
    return (_policy if args.what == "policy" else _controller)(args.file)


def _controller(file: Path) -> int:
    if file.suffix != ".py" or not file.stem.isidentifier():
        raise InputError(f"new: {file}: expected the name of a Python module, such as my_law.py")
    _are_new([file])
    _write(file, start().replace(NAMED, str(file)))
    print(f"{file}: the thesis's law in Python; docs/controllers.md says what everything in it is")
    print(f"  biped run level_normal --set law={file}:Law")
    return DONE


def _policy(file: Path) -> int:
    if file.suffix != ".toml" or not file.stem.isidentifier():
        raise InputError(f"new: {file}: expected the name of a card, such as my_policy.toml")
    network, law = file.with_suffix(".onnx"), file.with_suffix(".py")
    _are_new([file, network, law])
    shipped = folder("controllers") / "policy" / "h1.toml"
    _write(network, shipped.with_suffix(".onnx").read_bytes())
    lines = [line for line in shipped.read_text(encoding="utf-8").splitlines(keepends=True) if not line.startswith("#")]
    _write(file, "".join(lines).replace("h1.onnx", network.name))
    _write(law, start(POLICY).replace(f"{CALLED}.py:", f"{law}:").replace(CALLED, file.stem))
    print(
        f"{file}: a card, {network}: its network, {law}: the same in Python; docs/your-policy.md says what a card says"
    )
    print(f"  biped policy {file}")
    print(f"  biped run policy/h1 --set law={file} --out {file.stem}")
    print(f"  biped run policy/h1 --set law={law}:MyPolicy --out {file.stem}_python")
    return DONE


def _are_new(files: Sequence[Path]) -> None:
    for file in files:
        if os.path.lexists(file):
            raise InputError(f"new: {file}: is there already; expected another name, nothing is overwritten")


def _write(file: Path, content: str | bytes) -> None:
    try:
        if isinstance(content, bytes):
            file.write_bytes(content)
        else:
            write_text(file, content)
    except OSError as error:
        raise InputError(f"new: {file}: cannot be written: {reason(error)}") from None


def start(module: str = START) -> str:
    """The text of a module to start from."""
    spec = find_spec(module)
    assert spec is not None
    assert spec.origin is not None
    return Path(spec.origin).read_text(encoding="utf-8")
