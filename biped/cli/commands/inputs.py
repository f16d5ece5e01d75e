"""`biped list`, `new` and `model`: what a user writes is listed, begun and looked at."""

import argparse
import os
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path

from biped.base.errors import InputError, plain
from biped.base.files import SUFFIX, folder, locate, names, read_toml
from biped.base.writing import reason, write_text
from biped.cli import common


def add_list(commands: common.Commands) -> None:
    """Adds the parser of `biped list`."""
    common.command_parser(
        commands, "list", "list models, controllers, readings and scenarios, with a line each", list_command
    )


def list_command(args: argparse.Namespace) -> int:
    """Prints models, controllers and scenarios with a line each."""
    lines = listing()
    width = max(len(name) for _, name, _ in lines)
    kind = ""
    for this, name, text in lines:
        if this != kind:
            print(f"{this}/")
            kind = this
        print(f"  {name:<{width}}  {text}")
    return common.DONE


def listing() -> list[tuple[str, str, str]]:
    """Every model, controller, reading and scenario that has a name: (kind, name, one line)."""
    return [(kind, name, _one_line(kind, name)) for kind in SUFFIX for name in names(kind)]


def _one_line(kind: str, name: str) -> str:
    path = locate(kind, name, "list")
    if kind == "models":
        comment = path.read_text(encoding="utf-8").partition("<!--")[2].partition("-->")[0].strip()
        return plain(comment.partition(";")[0].partition("\n")[0].strip())
    return plain(read_toml(path).get("description", ""))


START = "biped.control.planar.start_law"
"""The module that is written; nothing of it is run here."""
NAMED = "my_law.py"
"""Names in the written files that stand for the user's own."""
POLICY, CALLED = "biped.control.start_policy", "my_policy"
"""The same of a policy in Python, beside its card."""


def add_new(commands: common.Commands) -> None:
    """Adds the parser of `biped new`."""
    parser = common.command_parser(
        commands, "new", "write files to start from", new_command,
        description="Writes files to start from. controller: the thesis's law for a planar biped, in readable "
        "Python. policy: a card with a small network for Unitree's H1, and the same in 40 lines of Python.",
    )  # fmt: skip
    parser.add_argument("what", choices=["controller", "policy"], help="the kind of file")
    file = (
        "the file to write: my_law.py of a controller, the card my_policy.toml of a policy; files that exist are kept"
    )
    parser.add_argument("file", type=Path, help=file)


def new_command(args: argparse.Namespace) -> int:
    """Writes them and says how to run them."""
    return (_policy if args.what == "policy" else _controller)(args.file)


def _controller(file: Path) -> int:
    if file.suffix != ".py" or not file.stem.isidentifier():
        raise InputError(f"new: {file}: expected the name of a Python module, such as my_law.py")
    _are_new([file])
    _write(file, start().replace(NAMED, str(file)))
    print(f"{file}: the thesis's law in Python; docs/controllers.md says what everything in it is")
    print(f"  biped run level_normal --set law={file}:Law")
    return common.DONE


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
    return common.DONE


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


def add_model(commands: common.Commands) -> None:
    """Adds the parser of `biped model`."""
    parser = common.command_parser(
        commands, "model", "show what is recognised in a model file, and every fault in it", model_command,
        simulates=True,
        description="Shows what is recognised in a model file, and lists every fault at once, each with what to "
        "write.",
    )  # fmt: skip
    parser.add_argument(
        "file", nargs="+", help="name in models/, or path of an MJCF or URDF file; several files make a table"
    )
    parser.add_argument(
        "--stand", action="store_true", help="also try whether each robot stands, in the physics of its file"
    )
    common.take_trust(parser)
    common.take_json(parser)


def model_command(args: argparse.Namespace) -> int:
    """Prints what the robot in a file is; the exit code says whether it can be run."""
    from biped.robot.report import look
    from biped.show.studies import model_document

    if args.stand or len(args.file) > 1:
        return _table(args)
    found = look(args.file[0])
    common.answer(args, found.as_dict(), model_document(found))
    return common.FAILED if found.faults else common.DONE


def _table(args: argparse.Namespace) -> int:
    """Prints files in a row each; the exit code says whether all are robots, and stand if that was asked."""
    from biped.show.studies import models_document
    from biped.studies.surveys import survey

    rows = survey(args.file, args.stand)
    common.answer(args, {"models": [row._asdict() for row in rows]}, models_document(rows))
    return common.FAILED if any(row.refused or row.stood is False for row in rows) else common.DONE
