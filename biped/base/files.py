"""Where models, controllers and scenarios are: the user's own path, or a name in the three folders."""

from __future__ import annotations

import difflib
import tomllib
from pathlib import Path
from typing import Any

from biped.base.errors import InputError

SUFFIX = {"models": ".xml", "controllers": ".toml", "scenarios": ".toml"}


def folder(kind: str) -> Path:
    """The folder of `models`, `controllers` or `scenarios`: beside the package, or inside it if installed."""
    package = Path(__file__).parents[1]
    installed = package / "data" / kind
    return installed if installed.is_dir() else package.parent / kind


def names(kind: str) -> list[str]:
    """Names that can be used for a kind, sub-folders included."""
    root = folder(kind)
    return sorted(str(p.relative_to(root).with_suffix("")) for p in root.rglob(f"*{SUFFIX[kind]}"))


def nearest(word: str, known: list[str]) -> str:
    """A sentence that names what the user may have meant."""
    close = difflib.get_close_matches(word, known, n=1, cutoff=0.5)
    if close:
        return f"did you mean '{close[0]}'?"
    return f"valid: {', '.join(known)}" if known else "there are none"


def locate(kind: str, name: str, asked_by: str, beside: Path | None = None) -> Path:
    """The file that a name or path stands for.

    Args:
        kind: `models`, `controllers` or `scenarios`.
        name: A name in that folder, or a path (with its suffix), relative to the working folder or to `beside`.
        asked_by: Who asks, for the error: `file: key`, or nothing.
        beside: Folder of the file that asks.

    Raises:
        InputError: There is no such file.
    """
    suffix = SUFFIX[kind]
    if not name.endswith(suffix):
        # A bare name means the folder of its kind: a scenario `uphill` may use the controller `uphill`.
        candidates = [folder(kind) / f"{name}{suffix}"]
    else:
        candidates = [base / name for base in (Path(), beside, folder(kind)) if base is not None]
    for candidate in candidates:
        if candidate.is_file():
            return candidate
    near = [f"{name}{suffix}" for base in (Path(), beside) if base is not None and (base / f"{name}{suffix}").is_file()]
    hint = f"did you mean the file '{near[0]}'?" if near else nearest(Path(name).stem, names(kind))
    raise InputError(
        f"{f'{asked_by}: ' if asked_by else ''}no {kind[:-1]} '{name}'; expected the path of a file *{suffix} or a "
        f"name: {hint}"
    )


def description_of(model: Path) -> Path:
    """The file that describes a model file: the TOML file of its name beside it, or else the human's."""
    own = model.with_suffix(".toml")
    return own if own.is_file() else folder("models") / "human.toml"


def canonical(kind: str, path: Path) -> str:
    """The name of a file in the folder of its kind, or the absolute path of one elsewhere."""
    try:
        return str(path.resolve().relative_to(folder(kind).resolve()).with_suffix(""))
    except ValueError:
        return str(path.resolve())


def label(path: Path) -> str:
    """A short name of a file for people: relative to the working folder or to the three folders if it is below them."""
    whole = path.resolve()
    for base, prefix in ((Path.cwd(), Path()), *((folder(kind), Path(kind)) for kind in SUFFIX)):
        if whole.is_relative_to(base.resolve()):
            return str(prefix / whole.relative_to(base.resolve()))
    return str(path)


def read_toml(path: Path) -> dict[str, Any]:
    """Reads a TOML file.

    Raises:
        InputError: It cannot be read or is not TOML.
    """
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{label(path)}: cannot be read: {_why(error)}; expected a TOML file in UTF-8") from error
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{label(path)}: not a TOML file: {error}") from error


def _why(error: OSError | UnicodeDecodeError) -> str:
    return str(error.strerror).lower() if isinstance(error, OSError) else str(error)


def layered(path: Path, kind: str, seen: tuple[Path, ...] = ()) -> tuple[dict[str, Any], dict[str, Path]]:
    """A TOML file on top of the one that it `extends`, and the file that each dotted key comes from.

    Raises:
        InputError: A file is missing, unreadable, or extends itself.
    """
    if path.resolve() in seen:
        chain = " -> ".join(label(file) for file in (*seen[seen.index(path.resolve()) :], path))
        raise InputError(f"{label(path)}: extends: files extend each other in a circle: {chain}")
    data = read_toml(path)
    below: dict[str, Any] = {}
    origin: dict[str, Path] = {}
    parent = data.pop("extends", None)
    if parent is not None:
        if not isinstance(parent, str):
            raise InputError(f"{label(path)}: extends: expected a name or path, got {parent!r}")
        at = locate(kind, parent, f"{label(path)}: extends", path.parent)
        below, origin = layered(at, kind, (*seen, path.resolve()))
    merge(below, data, origin, path)
    return below, origin


def merge(below: dict[str, Any], above: dict[str, Any], origin: dict[str, Path], path: Path, at: str = "") -> None:
    """Lays `above` over `below` in place: tables key by key, everything else as a whole."""
    for key, value in above.items():
        dotted = f"{at}{key}"
        if isinstance(value, dict) and isinstance(below.get(key), dict):
            merge(below[key], value, origin, path, f"{dotted}.")
        else:
            below[key] = value
        origin[dotted] = path
        if isinstance(value, dict):
            for inner in value:
                origin[f"{dotted}.{inner}"] = path
