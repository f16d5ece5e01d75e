"""Examines a model file before MuJoCo and Pinocchio parse it, and tries it in a process of its own.

A file of 1 kB can crash both or make them ask for all memory. Here it is read by a strict parser that stops at bounds;
what passes is compiled in another process first, with bounds on time and memory, because a list of known tricks is
never complete. Models of the package are spared both.
"""

import faulthandler
import math
import os
import re
import resource
import selectors
import signal
import stat
import struct
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import NoReturn
from xml.parsers import expat

from biped.base.errors import InputError
from biped.base.files import folder, label
from biped.base.trust import remedy, trusted

MOST_BYTES = 4_000_000
"""Of a model file with all that it includes; the human model has 8 kB."""
MOST_FILES = 32
"""Included files, and includes within includes."""
MOST_DEPTH = 64
"""Elements within elements."""
MOST_ELEMENTS = 20_000
MOST_ASSET_BYTES = 64_000_000
"""Of all meshes, textures and height fields together."""
MOST_PIXELS = 4096**2
"""Of all textures and height fields together."""
MOST_MEMORY = 256 * 2**20
"""[bytes] that a model may ask for by itself."""
PACKAGE = "package://"
"""Begins the names of files of a ROS package."""
LONGEST_NAME = 255
"""[bytes]."""

_MULTIPLIES = "it multiplies parts, and a biped has seven links: write out what is meant"
_PLUGIN = "it asks for compiled code, which a biped's model does not need"
_ABSENT = {
    "replicate": _MULTIPLIES,
    "composite": _MULTIPLIES,
    "flexcomp": _MULTIPLIES,
    "flex": "links are rigid",
    "skin": "links are rigid",
    "attach": "a model is one tree, written in one place",
    "extension": _PLUGIN,
    "plugin": _PLUGIN,
}
"""Elements that a model must do without, and why."""
_FILES = ("file", "filename", "fileright", "fileleft", "fileup", "filedown", "filefront", "fileback", "vertfile")
_FOLDERS = ("assetdir", "meshdir", "texturedir")
_UNITS = {"": 1, "k": 2**10, "m": 2**20, "g": 2**30, "t": 2**40, "p": 2**50, "e": 2**60}


def packaged(path: Path) -> bool:
    """Whether a model belongs to the package."""
    return path.resolve().is_relative_to(folder("models").resolve())


def examine(path: Path) -> None:
    """Reads a model file, all that it includes and the heads of its assets, without giving any of it to a library.

    Args:
        path: The MJCF file.

    Raises:
        InputError: It is too large, too deep, includes itself, asks for what a biped does not need, or says a number
            that is none.
    """
    _Examination(path).finish()


def files_of(path: Path) -> list[Path]:
    """A model file, all that it includes and its assets.

    Raises:
        InputError: As of `examine`.
    """
    return _Examination(path).files()


def spellings_of(file: str) -> tuple[str, ...]:
    """As what an asset may lie below its folder: as it is called, or by its last part; of a ROS package's, between."""
    plain = file.replace("\\", "/")
    if not plain.startswith(PACKAGE):
        return tuple(dict.fromkeys((file, plain.rpartition("/")[2])))
    whole = plain.removeprefix(PACKAGE)
    return tuple(dict.fromkeys((whole, whole.partition("/")[2], whole.rpartition("/")[2])))


class _Examination:
    """One model with its includes: what was counted so far."""

    def __init__(self, path: Path):
        self._folder = path.resolve().parent
        self._bytes = self._elements = self._pixels = 0
        self._read: set[Path] = set()
        self._folders = {""}
        self._assets: dict[tuple[str, str], str] = {}
        self._scan(path)

    def _scan(self, path: Path) -> None:
        whole, name = path.resolve(), label(path)
        if whole in self._read:
            raise InputError(f"{name}: include: included twice, or in a circle")
        self._read.add(whole)
        if len(self._read) > MOST_FILES:
            raise InputError(f"{name}: include: expected at most {MOST_FILES} files in all")
        self._bytes += self._size(path, name)
        if self._bytes > MOST_BYTES:
            raise InputError(f"{name}: expected at most {MOST_BYTES / 1e6:g} MB with all that it includes")
        _File(self, path, name).parse()

    def _size(self, path: Path, asked_by: str) -> int:
        """[bytes] of a regular file below the model's folder, or where the user trusts files."""
        if not path.resolve().is_relative_to(self._folder) and not trusted(path):
            raise InputError(f"{asked_by}: {path}: expected a file in the folder of the model, or below it; of one "
                             f"that lies elsewhere, {remedy(path)}")  # fmt: skip
        try:
            state = path.stat()
        except OSError as error:
            raise InputError(f"{asked_by}: {str(path)[:200]}: {str(error.strerror).lower()}") from None
        if not stat.S_ISREG(state.st_mode):
            raise InputError(f"{asked_by}: {path}: expected a regular file")
        return state.st_size

    def count(self, depth: int) -> str | None:
        """Counts an element; says what is too much."""
        self._elements += 1
        if depth > MOST_DEPTH:
            return f"expected elements at most {MOST_DEPTH} deep"
        if self._elements > MOST_ELEMENTS:
            return f"expected at most {MOST_ELEMENTS} elements"
        return None

    def draw(self, pixels: float) -> str | None:
        """Counts pixels; says what is too much."""
        self._pixels += pixels
        if self._pixels > MOST_PIXELS:
            return f"expected at most {MOST_PIXELS} pixels in all textures and height fields"
        return None

    def include(self, name: str, file: str, beside: Path) -> None:
        """Scans an included file. MuJoCo looks beside the file that asks and beside the model: both count."""
        places = [place / file for place in dict.fromkeys((beside.resolve(), self._folder))]
        found = [place for place in places if file and place.exists()]
        if not found:
            raise InputError(f"{name}: include: no file '{file[:LONGEST_NAME]}'")
        for path in found:
            self._scan(path)

    def asset(self, name: str, element: str, file: str) -> None:
        """Remembers a file to look at once all folders are known."""
        self._assets[element, file] = name

    def within(self, folder_: str) -> None:
        """Remembers a folder in which assets may lie."""
        self._folders.add(folder_)

    def files(self) -> list[Path]:
        """All that was read, and all assets that are there."""
        return sorted(
            self._read | {path.resolve() for _, file in self._assets for path in self._places(file) if path.is_file()}
        )

    def _places(self, file: str) -> list[Path]:
        """Files that an asset may be."""
        places = {self._folder / folder_ / spelling for folder_ in self._folders for spelling in spellings_of(file)}
        return sorted(place for place in places if place.exists())

    def finish(self) -> None:
        """Looks at assets, wherever the model may mean them to be."""
        total = 0
        for (element, file), name in self._assets.items():
            for path in self._places(file):
                total += self._size(path, f"{name}: {element}")
                if total > MOST_ASSET_BYTES:
                    raise InputError(f"{name}: {element}: expected at most {MOST_ASSET_BYTES / 1e6:g} MB of assets")
                if complaint := self.draw(_pixels_of(path)):
                    raise InputError(f"{name}: {element} '{file}': {complaint}")


class _File:
    """One file of a model, read by expat as it comes: nothing of it is kept, nothing nests in it but a number."""

    def __init__(self, whole: _Examination, path: Path, name: str):
        self._whole, self._path, self._name = whole, path, name
        self._depth = 0
        # The encoding that the libraries assume, whatever the file says of itself.
        self._parser = expat.ParserCreate("utf-8")
        self._parser.StartDoctypeDeclHandler = lambda *_: self._fail("<!DOCTYPE>", "a model needs no entities")
        self._parser.StartElementHandler = self._start
        self._parser.EndElementHandler = self._end

    def parse(self) -> None:
        try:
            self._parser.Parse(self._path.read_bytes(), True)
        except expat.ExpatError as error:
            raise InputError(f"{self._name}: not a model MuJoCo can compile: not XML: {error}") from None
        except OSError as error:
            raise InputError(f"{self._name}: cannot be read: {str(error.strerror).lower()}") from None

    def _fail(self, what: str, why: str) -> NoReturn:
        raise InputError(f"{self._name}: line {self._parser.CurrentLineNumber}: {what}: {why}")

    def _start(self, element: str, attributes: dict[str, str]) -> None:
        self._depth += 1
        shown = f"<{element[:40]}>"
        if complaint := self._whole.count(self._depth):
            self._fail(shown, complaint)
        if self._depth == 1 and element not in ("mujoco", "mujocoinclude", "robot"):
            self._fail(shown, "expected an MJCF model, <mujoco>")
        if element in _ABSENT:
            self._fail(shown, f"not taken: {_ABSENT[element]}")
        for key, value in attributes.items():
            self._attribute(f"{shown} {key[:40]}", key, value)
        self._named(shown, element, attributes)

    def _attribute(self, at: str, key: str, value: str) -> None:
        if key in ("name", "class", "childclass", *_FILES, *_FOLDERS):
            if len(value.encode()) > LONGEST_NAME:
                self._fail(at, f"expected at most {LONGEST_NAME} bytes, got {len(value.encode())}")
            if not value.isprintable():
                self._fail(at, f"expected printable characters, got {value!a:.100}")
        else:
            for word in re.findall(r"[+-]?(?:nan|inf)\w*|[+-]?[\d.]+[eE][+]?\d{3,}", value, re.IGNORECASE):
                if not math.isfinite(_number(word)):
                    self._fail(at, f"expected finite numbers, got {word[:40]}")

    def _named(self, shown: str, element: str, attributes: dict[str, str]) -> None:
        """Checks single elements for what they ask for."""
        files = [attributes[key] for key in _FILES if key in attributes]
        if element == "include":
            self._whole.include(self._name, attributes.get("file", ""), self._path.parent)
        elif element == "model":
            self._fail(shown, "not taken: a model is one tree, written in one place")
        elif element == "compiler":
            for key in _FOLDERS:
                self._whole.within(attributes.get(key, ""))
        elif element == "size" and "memory" in attributes:
            if _memory(attributes["memory"]) > MOST_MEMORY:
                self._fail(shown, f"memory: expected at most {MOST_MEMORY >> 20}M, got {attributes['memory'][:40]}")
        elif element in ("texture", "hfield"):
            keys = ("width", "height") if element == "texture" else ("nrow", "ncol")
            width, height = (abs(_number(attributes.get(key, "0"))) for key in keys)
            # A cube has six sides, whose height is its width.
            if complaint := self._whole.draw(6 * width * width if height == 0 else width * height):
                self._fail(shown, complaint)
        elif element == "option" and any(_number(attributes.get(key, "0")) > 1e4 for key in attributes
                                         if key.endswith(("iterations", "initpoints"))):  # fmt: skip
            self._fail(shown, "expected at most 10000 iterations of each kind")
        for file in files if element != "include" else ():
            self._whole.asset(self._name, element, file)

    def _end(self, _: str) -> None:
        self._depth -= 1


def _number(word: str) -> float:
    try:
        return float(word)
    except ValueError:
        return 0.0  # a word: the library says what it thinks of it


def _memory(text: str) -> float:
    """[bytes] of MuJoCo's `memory`: a number with a unit."""
    parts = re.fullmatch(r"\s*([\d.]+)\s*([kmgtpe]?)\s*", text.lower())
    return _number(parts[1]) * _UNITS[parts[2]] if parts else 0.0


def _pixels_of(path: Path) -> int:
    """Pixels that a PNG file says it has, before anything decodes it; 0 of any other file."""
    with open(path, "rb") as file:
        head = file.read(24)
    if len(head) < 24 or not head.startswith(b"\x89PNG\r\n\x1a\n"):
        return 0
    width, height = struct.unpack(">II", head[16:24])
    return width * height


MOST_SECONDS = 5
"""[s] of the processor's time; the human model takes 0.005."""
MOST_WAIT = 60.0
"""[s] by the clock, for what waits instead of working."""
MOST_BESIDES = 2048 * 2**20
"""[bytes] beyond what this process has already; where the system counts them (Linux)."""

_DONE, _COMPLAINT = b"+", b"-"


def tried(name: str, work: Callable[[], None]) -> None:
    """Does the work in a copy of this process, and throws the copy away.

    Args:
        name: Whose work it is, for the error.
        work: What to do.

    Raises:
        InputError: The work raised one, or anything else; it crashed; or it took too much time or memory.
    """
    ours, theirs = os.pipe()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # of threads: the copy waits for none of them
        child = os.fork()
    if child == 0:
        os.close(ours)
        _work(name, work, theirs)
    os.close(theirs)
    answer = None
    try:
        answer = _answer(ours)
    finally:
        os.close(ours)
        if answer is None:
            os.kill(child, signal.SIGKILL)
        status = os.waitpid(child, 0)[1]
    if answer != _DONE:
        raise InputError(_why(name, answer, status))


def _work(name: str, work: Callable[[], None], theirs: int) -> NoReturn:
    """The copy's whole life: it leaves neither by an exception nor through what the original does at its end."""
    answer = _DONE
    try:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
        faulthandler.disable()
        nowhere = os.open(os.devnull, os.O_RDWR)
        for stream in range(3):
            os.dup2(nowhere, stream)
        _bound()
        work()
    except InputError as error:
        answer = _COMPLAINT + str(error).encode()
    except MemoryError:
        answer = b""
    except BaseException as error:
        # MuJoCo's word for a std::bad_alloc is that it does not know it.
        known = "unknown exception" not in str(error)
        text = f"{name}: cannot be used: {type(error).__name__}: {' '.join(str(error).split())[:300]}"
        answer = _COMPLAINT + text.encode() if known else b""
    finally:
        try:
            os.write(theirs, answer[:4096])
        finally:
            os._exit(0)


def _bound() -> None:
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    used = int(sum(os.times()[:2]))  # a copy's clock starts at nothing, but not everywhere
    seconds = used + MOST_SECONDS
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds))
    pages = Path("/proc/self/statm")
    if pages.is_file():
        held = int(pages.read_text(encoding="ascii").split()[0]) * resource.getpagesize()
        most = held + MOST_BESIDES
        resource.setrlimit(resource.RLIMIT_AS, (most, most))


def _answer(ours: int) -> bytes | None:
    """All that the copy says before it ends; None if it does not end in time."""
    said, until = b"", time.monotonic() + MOST_WAIT
    with selectors.DefaultSelector() as ready:
        ready.register(ours, selectors.EVENT_READ)
        while ready.select(max(0.0, until - time.monotonic())):
            piece = os.read(ours, 4096)
            if not piece:
                return said
            said += piece
    return None


def _why(name: str, answer: bytes | None, status: int) -> str:
    """Says in words how the copy ended."""
    if answer is None:
        return f"{name}: took more than {MOST_WAIT:g} s to compile, waiting for something"
    if answer.startswith(_COMPLAINT):
        return answer[1:].decode(errors="replace")
    if os.WIFSIGNALED(status):
        killer = os.WTERMSIG(status)
        if killer in (signal.SIGXCPU, signal.SIGKILL):
            return f"{name}: took more than {MOST_SECONDS} s to compile"
        return f"{name}: crashes MuJoCo or Pinocchio ({signal.Signals(killer).name}): not a model either can compile"
    return f"{name}: takes more than {MOST_BESIDES >> 20} MB to compile"
