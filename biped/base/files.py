"""Where models, controllers, readings and scenarios are: a path, or a name in the folder of their kind."""

import difflib
import re
import tomllib
from pathlib import Path
from typing import Any

from biped.base.errors import InputError, echo, safe, short

PACKAGE = Path(__file__).parents[1]
"""Folder of the package."""
SUFFIX = {"models": ".xml", "controllers": ".toml", "readings": ".toml", "scenarios": ".toml"}

URDF = ".urdf"
"""Of the other kind of model files."""
MOST_BYTES = 1_000_000
"""Of a TOML file; the largest shipped one has four thousand."""
DEEPEST = 32
"""Most tables and lists within each other, and most parts of a dotted key."""
MOST_FILES = 32
"""Most files that extend one another."""

# The reader's time grows with the square of a dotted key's parts.
_LONG_KEY = re.compile(rf"""(?<![\w-])(?:(?:"[^"\n]*"|'[^'\n]*'|[\w-]++)[ \t]*+\.[ \t]*+){{{DEEPEST}}}""")


def folder(kind: str) -> Path:
    """The folder of a kind, such as `models` or `readings`: beside the package, or inside it if installed."""
    installed = PACKAGE / "data" / kind
    return installed if installed.is_dir() else PACKAGE.parent / kind


def names(kind: str) -> list[str]:
    """Names that can be used for a kind, sub-folders included."""
    root = folder(kind)
    return sorted(str(p.relative_to(root).with_suffix("")) for p in root.rglob(f"*{SUFFIX[kind]}"))


def nearest(word: str, known: list[str]) -> str:
    """A sentence that names what the user may have meant.

    Of a path its last part counts if it is nearly a name, or if no name is like the whole.
    """
    last = word.rpartition("/")[2]
    for one, cutoff in ((last, 0.8), (word, 0.5), (last, 0.5)):
        close = difflib.get_close_matches(one, known, n=1, cutoff=cutoff) if len(one) < 100 else []
        if close:
            return f"did you mean '{close[0]}'?"
    return f"valid: {short(', '.join(known), 500)}" if known else "there are none"


def locate(kind: str, name: str, asked_by: str, beside: Path | None = None) -> Path:
    """The file that a name or path stands for.

    Args:
        kind: `models`, `controllers`, `readings` or `scenarios`.
        name: A name in that folder, or a path (with its suffix), relative to the working folder or to `beside`.
        asked_by: Who asks, for the error: `file: key`, or nothing.
        beside: Folder of the file that asks.

    Raises:
        InputError: There is no such file.
    """
    suffix = SUFFIX[kind]
    if not name.endswith((suffix, URDF) if kind == "models" else suffix):
        # A bare name means the folder of its kind: a scenario `uphill` may use the controller `uphill`.
        candidates = [folder(kind) / f"{name}{suffix}"]
    else:
        candidates = [base / name for base in (Path(), beside, folder(kind)) if base is not None]
    for candidate in candidates:
        if is_file(candidate):
            return candidate
    near = [f"{name}{suffix}" for base in (Path(), beside) if base is not None and is_file(base / f"{name}{suffix}")]
    if near:
        hint = f"did you mean the file '{near[0]}'?"
    elif kind == "scenarios" and name.endswith((SUFFIX["models"], URDF)) and is_file(Path(name)):
        hint = f"'{safe(name)}' is a model: biped model says what it is, and a scenario names it (docs/robots.md)"
    else:
        hint = nearest(name.removesuffix(Path(name).suffix), names(kind))
    files = f"*{suffix} or *{URDF}" if kind == "models" else f"*{suffix}"
    raise InputError(
        f"{f'{asked_by}: ' if asked_by else ''}no {kind[:-1]} '{safe(name)}'; expected the path of a "
        f"file {files} or a name: {hint}"
    )


def is_file(path: Path) -> bool:
    """Whether there is such a file; a name that no file can have (too long, a zero in it) is none."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def description_of(model: Path) -> Path:
    """The file that describes a model file: the TOML file of its name beside it, or else the human's."""
    own = model.with_suffix(".toml")
    return own if is_file(own) else folder("models") / "human.toml"


def canonical(kind: str, path: Path) -> str:
    """The name of a file in the folder of its kind, or the absolute path of one elsewhere."""
    try:
        inside = path.resolve().relative_to(folder(kind).resolve())
        return str(inside.with_suffix("") if inside.suffix == SUFFIX[kind] else inside)
    except ValueError:
        return str(path.resolve())


def label(path: Path) -> str:
    """A short name of a file for people: relative to the working folder, or to the folder of its kind, if below one."""
    try:
        whole, here = path.resolve(), Path.cwd()
    except OSError:  # the working folder is gone
        return str(path)
    for base, prefix in ((here, Path()), *((folder(kind), Path(kind)) for kind in SUFFIX)):
        if whole.is_relative_to(base.resolve()):
            return str(prefix / whole.relative_to(base.resolve()))
    return str(path)


def read_toml(path: Path) -> dict[str, Any]:
    """Reads a TOML file.

    Raises:
        InputError: It cannot be read, is not TOML, or is larger or deeper than any scenario or gait.
    """
    try:
        with open(path, "rb") as file:
            text = file.read(MOST_BYTES + 1).decode("utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{label(path)}: cannot be read: {_why(error)}; expected a TOML file in UTF-8") from error
    if len(text) > MOST_BYTES:
        raise InputError(f"{label(path)}: expected a file of at most {MOST_BYTES // 1000} kB")
    try:
        return parse_toml(text)
    except ValueError as error:
        raise InputError(f"{label(path)}: not a TOML file: {safe(error)}") from None


def parse_toml(text: str) -> dict[str, Any]:
    """Reads TOML, however hostile.

    Raises:
        ValueError: It is not TOML, or nothing that anybody would write.
    """
    if _LONG_KEY.search(text):
        raise ValueError(f"expected keys of at most {DEEPEST} parts")
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        raise
    except ValueError:  # Python refuses to convert it
        raise ValueError("expected numbers of fewer digits") from None
    except RecursionError:
        raise ValueError(_TOO_DEEP) from None
    level: list[Any] = [data]
    for _ in range(DEEPEST):
        level = [
            inner
            for outer in level
            for inner in (outer.values() if isinstance(outer, dict) else outer)
            if isinstance(inner, dict | list)
        ]
    if level:
        raise ValueError(_TOO_DEEP)
    return data


_TOO_DEEP = f"expected at most {DEEPEST} tables or lists within each other"


def _why(error: OSError | UnicodeDecodeError) -> str:
    return str(error.strerror).lower() if isinstance(error, OSError) else str(error)


def layered(path: Path, kind: str) -> tuple[dict[str, Any], dict[str, Path]]:
    """A TOML file on top of the one that it `extends`, and the file that each dotted key comes from.

    Raises:
        InputError: A file is missing, unreadable, or extends itself.
    """
    layers: list[tuple[Path, dict[str, Any]]] = []
    seen: list[Path] = []
    at: Path | None = path
    while at is not None:
        if at.resolve() in seen:
            chain = " -> ".join(label(file) for file in (*seen[seen.index(at.resolve()) :], at))
            raise InputError(f"{label(at)}: extends: files extend each other in a circle: {short(chain)}")
        if len(layers) == MOST_FILES:
            raise InputError(f"{label(path)}: extends: expected at most {MOST_FILES} files that extend one another")
        seen.append(at.resolve())
        data = read_toml(at)
        layers.append((at, data))
        parent = data.pop("extends", None)
        if parent is not None and not isinstance(parent, str):
            raise InputError(f"{label(at)}: extends: expected a name or path, got {echo(parent)}")
        at = None if parent is None else locate(kind, parent, f"{label(at)}: extends", at.parent)
    below: dict[str, Any] = {}
    origin: dict[str, Path] = {}
    for file, data in reversed(layers):
        merge(below, data, origin, file)
    return below, origin


FREE = frozenset({"draw", "expect", "sweep", "thesis"})
"""Tables with keys of the user's choice: an empty one takes away what files below say in it."""


def merge(below: dict[str, Any], above: dict[str, Any], origin: dict[str, Path], path: Path, at: str = "",
          emptied: bool = False) -> None:  # fmt: skip
    """Lays `above` over `below` in place: tables key by key, everything else as a whole.

    Args:
        below: What is changed.
        above: What is laid over it.
        origin: The file of each dotted key, which is changed too.
        path: The file of `above`.
        at: What dotted keys begin with.
        emptied: Whether any empty table takes away what is below it, and not those of `FREE` alone.
    """
    for key, value in above.items():
        dotted = f"{at}{key}"
        origin[dotted] = path
        if isinstance(value, dict):
            there = None if value == {} and (emptied or key in FREE) else below.get(key)
            # A table of its own: what is laid over it later must not reach the one it came from.
            below[key] = there if isinstance(there, dict) else {}
            merge(below[key], value, origin, path, f"{dotted}.", emptied)
        else:
            below[key] = value
