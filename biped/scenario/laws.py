"""Laws that a scenario asks for: those for any robot by name, and a law of the user's own.

Of the latter: which file it is, whether it may run, what it was when results were made.
"""

import ast
import re
import warnings
from collections.abc import Sequence
from hashlib import sha256
from pathlib import Path
from typing import Any, NamedTuple

from biped.base.errors import InputError, safe
from biped.base.files import folder, is_file, nearest
from biped.base.trust import grant, refusal, trusted
from biped.scenario.valid import Fail

Keys = dict[str, tuple[str, ...]]
"""Keys of a scenario by table; "" is the scenario itself."""


class BuiltIn(NamedTuple):
    """A law of this package.

    Attributes:
        place: `module:Class`, imported where it is used.
        meaning: In one line.
        reads: Keys that it takes notice of besides those that hold whatever the law is (`biped.scenario.general`).
    """

    place: str
    meaning: str
    reads: Keys


_THESIS: Keys = {
    "": ("controller", "gains", "change", "backstep"),
    "start": ("walking",),
    "ground": ("angles",),
    "sensing": (
        "contact_height",
        "heel_on",
        "heel_off",
        "toe_on",
        "toe_off",
        "extended",
        "ahead",
        "late_stance",
        "passing",
    ),
    "actuation": ("mode", "assist", "contacts", "pushing"),
    "control": ("mechanics",),
    "randomise": ("controller_mass_matrix", "controller_constraints"),
}

THESIS = "thesis"
"""On a planar biped of seven links it is the law of scenarios that name none, and naming it is as good as none."""
BUILT_IN: dict[str, BuiltIn] = {
    THESIS: BuiltIn("biped.control.space.law:Spatial", "the thesis's law, for any biped", _THESIS),
    "stand": BuiltIn("biped.control.stand:stand", "stands, and balances what pushes it", {}),
}


_EARLIER = {"spatial": THESIS}


def named_now(law: Any) -> Any:
    """The name that a law has now; scenarios and results of earlier versions may have an earlier one."""
    return _EARLIER.get(law, law) if isinstance(law, str) else law


CARD = ".toml"
"""End of the name of a policy's card."""


def is_card(law: str | None) -> bool:
    """Whether a law is a policy's card."""
    return law is not None and law.endswith(CARD)


def own_law(law: str | None) -> bool:
    """Whether a scenario's law is its user's own, which runs only if it is trusted."""
    return law is not None and law not in BUILT_IN


LONGEST = 255
"""Letters of a file's name."""

_NETWORK = re.compile(r"^network\s*=", re.MULTILINE)


def check_form(text: str, fail: Fail) -> None:
    """Rejects a law that is neither the name of one nor has the form of a file's."""
    file, _, name = text.rpartition(":")
    if own_law(text) and not is_card(text) and not (file.endswith(".py") and name.isidentifier()):
        raise fail("law", f"expected 'path.py:Class', a policy's card 'card.toml' or one of {', '.join(BUILT_IN)}, got "
                   f"'{safe(text)}'; {nearest(text, list(BUILT_IN))}")  # fmt: skip


def find_law(text: str, beside: Path | None, fail: Fail) -> str:
    """The law that `path.py:Class` names, with the whole path of its file.

    Args:
        text: What the scenario says, of the right form (`check_form`).
        beside: Folder of the file that says so: the law is looked for there first. None: the command line, whose
            paths are the working folder's, and which is the user's own word.
        fail: Makes the error.

    Raises:
        InputError: There is no such file, or it is not trusted.
    """
    card = is_card(text)
    file, _, name = (text, ":", "") if card else text.rpartition(":")
    places = [Path()] if beside is None else [beside, Path()]
    if card:
        places.append(folder("controllers"))  # those that are shipped
    for place in places:
        path = place / file
        if is_file(path):
            break
    else:
        there = cards_in(places) if card else [str(p) for place in dict.fromkeys(places) for p in place.glob("*.py")]
        raise fail(
            "law",
            f"no file '{safe(file)}'; expected a {'card' if card else 'Python file'}, relative to the "
            "scenario or the working folder: "
            f"{nearest(file, there)}",
        )
    if card:
        return str(path.resolve())  # data, none of which is run
    if beside is None:
        grant(path)
    if not trusted(path):
        raise fail("law", refusal(path))
    return f"{path.resolve()}:{name}"


def cards_in(places: Sequence[Path]) -> list[str]:
    """The policies' cards that the places hold, as a scenario names them: the files that name a network."""
    shipped = folder("controllers")
    files = [
        path.relative_to(shipped) if place == shipped else path
        for place in dict.fromkeys(places)
        for path in sorted(place.rglob("*" + CARD) if place == shipped else place.glob("*" + CARD))
        if _NETWORK.search(path.read_text(encoding="utf-8", errors="replace"))
    ]
    return [str(file) for file in files]


def file_of(law: str) -> Path:
    """The file of a law: of `path.py:Class` or of a policy's card."""
    return Path(law if is_card(law) else law.rpartition(":")[0])


def digest(law: str) -> str:
    """SHA-256 of all files of a law (`files_of`).

    Args:
        law: `path.py:Class`.

    Raises:
        InputError: A file cannot be read.
    """
    folder = file_of(law).parent
    state = sha256()
    for path in files_of(law):
        text = _read(path)
        state.update(f"{path.relative_to(folder).as_posix()}\0{len(text)}\0".encode() + text)
    return state.hexdigest()


def files_of(law: str) -> list[Path]:
    """A law's file and the files beside it or below that it imports or names, one through another.

    A file is named by a string in Python code, such as that of a network or of a table of numbers, or by a network as
    where its weights are. A name that is only put together while the law runs is not found.

    Args:
        law: `path.py:Class`.

    Raises:
        InputError: A file cannot be read.
    """
    file = file_of(law)
    found: set[Path] = set()
    left = [file]
    while left:
        path = left.pop()
        if path not in found:
            found.add(path)
            if path.suffix == ".py":
                left += _beside(file.parent, _read(path))
            elif path.suffix == CARD:
                left += _below(path.parent, set(re.findall(r"[^\s\"']+\.onnx", _read(path).decode(errors="replace"))))
            elif path.suffix == ".onnx":
                left += _weights(path)
    return sorted(found)


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise InputError(f"law: {path} cannot be read: {str(error.strerror).lower()}", "law") from None


def _weights(network: Path) -> list[Path]:
    """Files of weights that an ONNX file names: entries `location` of its tensors (protobuf: key, length, value)."""
    text, names = _read(network), set[str]()
    for match in re.finditer(rb"\x0a\x08location\x12", text):
        size = shift = 0
        for at in range(match.end(), min(match.end() + 3, len(text))):
            size |= (text[at] & 0x7F) << shift
            shift += 7
            if text[at] < 0x80:
                names.add(text[at + 1 : at + 1 + size].decode(errors="replace"))
                break
    return _below(network.parent, names)


def _below(folder: Path, names: set[str]) -> list[Path]:
    """Files of these names in a folder or below it."""
    found = []
    for name in sorted(names):
        if 0 < len(name) <= LONGEST and name.isprintable() and not Path(name).is_absolute() and ".." not in name:
            path = folder / name
            if is_file(path):
                found.append(path)
    return found


def _beside(folder: Path, source: bytes) -> list[Path]:
    """Files of a folder that Python code imports or names; code that does not parse has none."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # they come when it runs
            tree = ast.parse(source)
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return []
    names: set[str] = set()
    named: set[str] = set()
    logs: set[object] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            names |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            named.add(node.value)
        elif isinstance(node, ast.Call) and _writes(node):
            logs |= {one.value for one in ast.walk(node) if isinstance(one, ast.Constant)}
    places = {
        place.as_posix()
        for name in names
        for parts in [name.split(".")]
        for n in range(1, len(parts) + 1)
        for place in (Path(*parts[:n]).with_suffix(".py"), Path(*parts[:n], "__init__.py"))
    }
    named -= logs
    folders = [Path(name) for name in named if re.fullmatch(r"[\w-]{1,60}", name) and (folder / name).is_dir()]
    return _below(folder, places | named | {(there / name).as_posix() for there in folders for name in named})


def _writes(call: ast.Call) -> bool:
    """Whether a call writes to the file that it names: what a law logs is no part of it."""
    name = getattr(call.func, "attr", getattr(call.func, "id", ""))
    arguments = (*call.args, *(word.value for word in call.keywords))
    words = [one.value for one in arguments if isinstance(one, ast.Constant) and isinstance(one.value, str)]
    mode = any(re.fullmatch(r"[bt+]*[wax][bt+]*", word) for word in words)
    return (name == "open" and mode) or name.startswith(("write", "save", "to_", "dump"))


def changed_since(law: str, then: str | None) -> str | None:
    """A warning if a law is no longer what it was, else None.

    Args:
        law: `path.py:Class`.
        then: Its digest when results were made; None: nothing is known.
    """
    if then is None or (now := digest(law)) == then:
        return None
    return (
        f"{file_of(law)} has changed since these results were made (SHA-256 {then[:12]}… then, {now[:12]}… "
        f"now): they cannot be made again with it; to run it as it is now, give --set law={law}"
    )
