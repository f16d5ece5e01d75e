"""A law of the user's own in a scenario: which file, whether it may run, what it was when results were made."""

from __future__ import annotations

import ast
import warnings
from hashlib import sha256
from pathlib import Path

from biped.base.errors import InputError
from biped.base.files import is_file, nearest
from biped.base.text import said
from biped.base.trust import grant, refusal, trusted
from biped.scenario.valid import Fail


def find_law(text: str, beside: Path | None, fail: Fail) -> str:
    """The law that `path.py:Class` names, with the whole path of its file.

    Args:
        text: What the scenario says.
        beside: Folder of the file that says so: the law is looked for there first. None: the command line, whose
            paths are the working folder's, and which is the user's own word.
        fail: Makes the error.

    Raises:
        InputError: There is no such file, or it is not trusted.
    """
    file, colon, name = text.rpartition(":")
    if not colon or not file.endswith(".py") or not name.isidentifier():
        raise fail("law", f"expected 'path.py:Class', got '{said(text)}'")
    places = [Path()] if beside is None else [beside, Path()]
    for place in places:
        path = place / file
        if is_file(path):
            break
    else:
        there = [str(p) for place in dict.fromkeys(places) for p in sorted(place.glob("*.py"))]
        raise fail(
            "law",
            f"no file '{said(file)}'; expected a Python file, relative to the scenario or the working folder: "
            f"{nearest(file, there)}",
        )
    if beside is None:
        grant(path)
    if not trusted(path):
        raise fail("law", refusal(path))
    return f"{path.resolve()}:{name}"


def digest(law: str) -> str:
    """SHA-256 of a law: its file and the files beside it that it imports, or names with `.onnx`, one through another.

    Args:
        law: `path.py:Class`.

    Raises:
        InputError: A file cannot be read.
    """
    file = Path(law.rpartition(":")[0])
    found: dict[str, bytes] = {}
    left = [file]
    state = sha256()
    try:
        while left:
            path = left.pop()
            name = path.relative_to(file.parent).as_posix()
            if name not in found:
                found[name] = path.read_bytes()
                left += _beside(file.parent, found[name]) if path.suffix == ".py" else []
    except OSError as error:
        raise InputError(f"law: {path} cannot be read: {str(error.strerror).lower()}", "law") from None
    for name, text in sorted(found.items()):
        state.update(f"{name}\0{len(text)}\0".encode() + text)
    return state.hexdigest()


def _beside(folder: Path, source: bytes) -> list[Path]:
    """Files in a folder that Python code imports, and networks that it names; code that does not parse has none."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # they come when it runs
            tree = ast.parse(source)
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return []
    names: set[str] = set()
    networks: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            names |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and node.value.endswith(".onnx"):
            networks.add(node.value)
    candidates = [folder / name for name in sorted(networks) if Path(name).name == name] + [
        place
        for name in sorted(names)
        for parts in [name.split(".")]
        for n in range(1, len(parts) + 1)
        for place in (folder.joinpath(*parts[:n]).with_suffix(".py"), folder.joinpath(*parts[:n], "__init__.py"))
    ]
    return [path for path in candidates if is_file(path)]


def changed_since(law: str, then: str | None) -> str | None:
    """What to say of a law that is no longer what it was, or None if it is.

    Args:
        law: `path.py:Class`.
        then: Its digest when results were made; None: nothing is known.
    """
    if then is None or (now := digest(law)) == then:
        return None
    return (
        f"{law.rpartition(':')[0]} has changed since these results were made (SHA-256 {then[:12]}… then, {now[:12]}… "
        f"now): they cannot be made again with it; to run it as it is now, give --set law={law}"
    )
