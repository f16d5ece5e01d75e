"""Finished work, line by line, for whatever is killed to go on from; and its origin, the files and versions behind it.

The first line of a journal says what the work is part of and what it was done with: rows of different origin never
mix. Every other line is one record in JSON whose last key, `sum`, is a digest of the line and of that head: a line
that was cut, garbled, glued, altered or that belongs to another journal does not match, is left out with a word, and
its work is done again.

How kernels are compiled does not matter to the last digits of a run: plain Python, no optimisation, a generic
processor and any number of jobs give the same bits. What matters is the library code that adds and multiplies:
MuJoCo, Pinocchio, the BLAS behind NumPy (it picks its loops by the processor) and the C library's sines (likewise).
See docs/regression.md.
"""

import ctypes
import json
import platform
import re
from collections.abc import Iterator, Mapping
from contextlib import suppress
from functools import cache
from hashlib import blake2b
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from biped.base import VERSION
from biped.base.errors import InputError
from biped.base.files import PACKAGE, description_of, label, locate
from biped.base.kernels import digest
from biped.base.writing import dumps, with_nan, written
from biped.ensemble.plan import Plan
from biped.robot.safety import files_of as model_files
from biped.scenario.engines import ENGINES
from biped.scenario.gait import read_reading, read_settings
from biped.scenario.laws import files_of as law_files
from biped.scenario.laws import own_law
from biped.scenario.reading import to_toml

FORMAT = 1
_SUM = re.compile(rb', "sum": "([0-9a-f]{16})"}$')


class Journal:
    """A journal of records.

    Args:
        path: The file.
        about: What the records are part of and what they are made with; records of anything else are not continued.
    """

    def __init__(self, path: Path, about: Mapping[str, str]):
        self.path = path
        self.about = dict(about)
        self._head = dumps({"journal": FORMAT, **about}).encode()
        self._key = blake2b(self._head, digest_size=32).digest()

    def read(self) -> tuple[list[dict[str, Any]], list[str]]:
        """The records, in the order they were noted, and a word on each kind of line that had to be left out.

        The file then holds these records alone. A number that does not exist is nan.

        Raises:
            InputError: It is the journal of something else, or of an earlier version.
            OSError: It cannot be read or mended.
        """
        if not self.path.is_file():
            return [], []
        records, bad, older, headed, whole = [], [], 0, False, True
        for number, line, whole in self._lines():  # noqa: B007
            record = self._record(line)
            if record is not None:
                records.append(record)
                continue
            if line == self._head:
                headed = True
                continue
            other = _parsed(line)
            if not headed and not records and other is not None and "journal" in other:
                raise InputError(self._differs(other))
            older += other is not None and "index" in other and "sum" not in other
            bad.append(number)
        if older and not headed and not records:
            raise InputError(
                f"{label(self.path)}: begun by a version of biped that did not note what its runs were made with; they "
                "cannot be told to belong here: choose another folder, or remove the file to make all runs again"
            )
        if bad or not headed or not whole:
            with written(self.path) as part, open(part, "wb") as file:
                file.write(self._head + b"\n")
                for record in records:
                    file.write(self._line(record))
        if not bad:
            return records, []
        shown = ", ".join(map(str, bad[:5])) + (", …" if len(bad) > 5 else "")
        lines = f"line {shown} is" if len(bad) == 1 else f"{len(bad)} lines ({shown}) are"
        return records, [f"{label(self.path)}: {lines} damaged or from elsewhere: left out, and the work done again"]

    def note(self, record: Mapping[str, Any]) -> dict[str, Any]:
        """Adds a record; it is with the system when this returns, and survives the end of this process.

        Returns:
            The record as it will be read: what goes on from a journal must not tell it from what was never stopped.

        Raises:
            OSError: It cannot be written.
        """
        with open(self.path, "ab") as file:
            line = self._line(record)
            file.write(line if file.tell() else self._head + b"\n" + line)
        return with_nan(json.loads(dumps(record)))

    def _lines(self) -> Iterator[tuple[int, bytes, bool]]:
        """Lines, which end at a line feed and nowhere else: number, text without it, whether it is there."""
        with open(self.path, "rb") as file:
            for number, line in enumerate(file, 1):
                yield number, line.removesuffix(b"\n"), line.endswith(b"\n")

    def _line(self, record: Mapping[str, Any]) -> bytes:
        text = dumps(record).encode()
        return text[:-1] + b', "sum": "' + self._sum(text) + b'"}\n'

    def _sum(self, text: bytes) -> bytes:
        return blake2b(text, digest_size=8, key=self._key).hexdigest().encode()

    def _record(self, line: bytes) -> dict[str, Any] | None:
        """The record in a line of this journal; None for any other line."""
        found = _SUM.search(line)
        text = line[: found.start()] + b"}" if found else b""
        return with_nan(json.loads(text)) if found and self._sum(text) == found[1] else None

    def _differs(self, other: Mapping[str, Any]) -> str:
        here = {"journal": FORMAT, **self.about}
        names = [name for name in {**here, **other} if other.get(name) != here.get(name)]
        there, now = (", ".join(f"{name} {of.get(name, 'unknown')!s:.80}" for name in names) for of in (other, here))
        return (
            f"{label(self.path)}: its runs were made with {there}; here is {now}: runs of the two are not mixed; "
            "choose another folder, or remove the file to make all runs again"
        )


def _parsed(line: bytes) -> dict[str, Any] | None:
    """The object in a line, if it is one."""
    try:
        value = json.loads(line)
    except (ValueError, RecursionError):  # UnicodeDecodeError is a ValueError
        return None
    return value if isinstance(value, dict) else None


LIBRARIES = ("mujoco", "pin", "numpy", "scipy")


@cache
def blas() -> str:
    """The name of the loops that NumPy's OpenBLAS picked for this processor, or was told to pick; empty of another."""
    import numpy as np

    for library in Path(np.__file__).parents[1].glob("numpy.libs/*openblas*"):
        with suppress(OSError, AttributeError):
            name = ctypes.CDLL(str(library)).scipy_openblas_get_corename64_
            name.restype = ctypes.c_char_p
            return name().decode()
    return ""


def here() -> dict[str, str]:
    """This platform: system, C library, the processor's vector instructions, BLAS loops and library versions."""
    import numpy as np

    simd = np.show_config(mode="dicts")["SIMD Extensions"]
    return {
        "system": f"{platform.system()} {platform.machine()}",
        "libc": " ".join(platform.libc_ver()).strip(),
        "instructions": " ".join(simd.get("found", [])),
        "blas": blas(),
        **{name: version(name) for name in LIBRARIES},
    }


def key(of: dict[str, str]) -> str:
    """A short name of a platform, by its instructions and not by the BLAS loops that these choose."""
    of = {name: value for name, value in of.items() if name != "blas"}
    return blake2b(json.dumps(of, sort_keys=True).encode(), digest_size=4).hexdigest()


def sources() -> str:
    """A short name of the present state of all compiled sources."""
    return digest(PACKAGE)


PLACE = ("system", "libc", "instructions", "blas")
"""Of an origin, what kind of machine it is: on another kind, the last bits may be others."""


_MORE = ("scenario", "ensemble")
"""Rooms without kernels that runs come from: what a scenario means, and what is drawn."""


def origin_of(plan: Plan) -> dict[str, str]:
    """Digest of the effective scenario and of every file that its runs read; versions; and platform.

    Of libraries that not every run needs, an engine's or onnxruntime, only those count that these runs use.
    """
    state = blake2b(to_toml(plan.scenario).encode(), digest_size=8)
    files = files_read_by(plan)
    for path in files:
        data = path.read_bytes()
        state.update(f"{path.name}\0{len(data)}\0".encode() + data)
    libraries = [ENGINES[plan.scenario.engine].library, *("onnxruntime" for path in files if path.suffix == ".onnx")]
    return {
        "scenario": state.hexdigest(),
        "biped": VERSION,
        "kernels": digest(PACKAGE, _MORE),
        **here(),
        **{name: installed(name) for name in libraries if name},
    }


def files_read_by(plan: Plan) -> list[Path]:
    """Files that runs of a plan read: models with what they include and their descriptions, gaits, and the law's.

    Gaits and readings count where they vary, or the speed of a family does; else they are written out in the scenario.

    Raises:
        InputError: A file cannot be read.
    """
    s = plan.scenario
    varied: dict[str, list[object]] = {key: list(values) for key, values in s.sweep.items()}
    for key, drawn in s.randomise.draw.items():
        varied.setdefault(key, []).extend(drawn.choice or drawn.grid or ())
    models = [plan.model, *(locate("models", str(name), "model") for name in varied.get("model", ()))]
    files = [file for model in models for file in (*model_files(model), description_of(model))]
    if any(key.endswith(("controller", "reading", "gains.speed")) for key in varied):
        for kind, own, read in ("controller", s.controller, read_settings), ("reading", s.reading, read_reading):
            names = [own or "", *(str(name) for key in varied if key.endswith(kind) for name in varied[key])]
            found = [locate(f"{kind}s", name, kind) for name in names if name]
            files += [file for path in found for file in (path, *read(path)[1].keys.values())]
    if s.law is not None and own_law(s.law):
        files += law_files(s.law)
    return list(dict.fromkeys(file.resolve() for file in files))


def installed(name: str) -> str:
    """The version of a package that is installed; empty of one that is not."""
    try:
        return version(name)
    except PackageNotFoundError:
        return ""
