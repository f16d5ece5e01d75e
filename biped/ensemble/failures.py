"""Files of runs that failed in a campaign: their last seconds, in a tenth of their size, and how to see each again.

Every tick is kept, to a resolution that nobody can see: an xz stream of a line of JSON, then for each quantity of a
trajectory whole numbers of its resolution, as differences from tick to tick, their low bytes first: what changes
smoothly packs well. States, flags and a law's own signals are exact. What a replay needs is none of this but the
scenario and the number of the run: it gives the same bytes again.
"""

import json
import lzma
import math
import re
import shlex
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from biped.base.errors import InputError, why
from biped.base.files import label
from biped.base.writing import write_text, written
from biped.ensemble.guard import complaining
from biped.measure.stored import trajectory_from
from biped.measure.trajectory import Trajectory
from biped.robot.columns import WIDTH, Columns, columns_of, width_of
from biped.robot.load import robot_from

FAILURES = "failures"
"""Where, in a results folder."""

_KEPT = re.compile(r"run-\d{5,}\.(xz|txt)|\.run-\d{5,}\.(xz|txt)\.part")
_HALF = re.compile(r"\.run-\d{5,}\.(xz|txt)\.part")


def keep(
    folder: Path, number: int, cause: str, save: Callable[[Path], None], more: str = "", traceback: str = ""
) -> None:
    """Keeps a trajectory of run `number` of a results folder, wherever it was made, and how to see it again.

    Args:
        folder: The results folder.
        number: Of the run.
        cause: How it ended.
        save: Writes the trajectory to a file.
        more: Arguments that the command needs besides.
        traceback: Of a law of the user's own that raised.

    Raises:
        RunError: It cannot be written.
    """
    kept = folder / FAILURES
    again = f"biped run {shlex.quote(label(folder / 'scenario.toml'))} --only {number}{more}"
    with complaining(kept):
        kept.mkdir(exist_ok=True)
        with written(kept / f"run-{number:05d}{SUFFIX}") as part:
            save(part)
        write_text(kept / f"run-{number:05d}.txt", f"{cause}\nagain: {again}\n{traceback}")


def files_of(folder: Path, half: bool = False) -> list[Path]:
    """Files that `keep` left in a results folder, or only those that it was writing when it was ended."""
    if not (folder / FAILURES).is_dir():
        return []
    return [path for path in (folder / FAILURES).iterdir() if (_HALF if half else _KEPT).fullmatch(path.name)]


SUFFIX = ".xz"

RESOLUTION = {
    "q": 1e-6, "v": 1e-4, "u": 0.01, "Q_d": 0.01, "height": 1e-6, "force": 0.1, "stop": 0.01,
    "point": 1e-6, "com": 1e-6, "com_velocity": 1e-4, "base": 1e-6, "figure": 1e-5, "ground_force": 0.1,
    "energy": 1e-3, "work": 1e-4, "given": 1e-4,
}  # fmt: skip
"""[m, rad], [m/s, rad/s], [N m], [N, N m], [m], [N], [N m]; [J]; states and flags are whole numbers."""
_TWICE = ("q", "v", "height", "point", "com", "com_velocity", "base", "figure")
"""Of these differences of differences are kept: they are smoother still."""
_LOST = np.iinfo(np.int64).min // 4
"""Stands for what is not finite."""
_LARGEST = 2.0**60

MOST_ROWS = 200_000
"""Of a file that is read: whoever sends one cannot make it fill the memory."""
_MOST_HEAD = 1_000_000
_MEMORY = 256 << 20
_WINDOW = 2**23
"""[bytes] that the packer looks back at most. Packing takes 12 times as much memory, so short runs have less."""


def save_packed(trajectory: Trajectory, path: Path) -> None:
    """Writes a trajectory.

    Raises:
        OSError: It cannot be written.
    """
    n = len(trajectory)
    about = {"rows": n, "first": round(float(trajectory.time[0]) / trajectory.tick)} | trajectory.about
    parts = [json.dumps(about).encode() + b"\n"]
    parts += [_packed(trajectory.column(name).reshape(n, -1), name) for name in trajectory.columns if name != "time"]
    parts.append(_exact(trajectory.log[:, trajectory.width :]))
    data = b"".join(parts)
    window = min(max(4096, 1 << len(data).bit_length()), _WINDOW)
    path.write_bytes(lzma.compress(data, filters=[{"id": lzma.FILTER_LZMA2, "preset": 6, "dict_size": window}]))


def load_packed(path: Path) -> Trajectory:
    """Reads what `save_packed` wrote.

    Raises:
        InputError: It is missing, something else, or larger than any run that was kept.
    """
    try:
        head, body = _unpacked(path.read_bytes())
        about: dict[str, Any] = json.loads(head)
        rows, first = int(about.pop("rows")), int(about.pop("first"))
        if not (0 < rows <= MOST_ROWS and math.isfinite(about["tick"]) and about["tick"] > 0.0):
            raise ValueError(f"{rows} rows of {about['tick']} s")
        about["signal_names"] = tuple(str(name) for name in about["signal_names"])
        there, width = _columns(about)
        columns = width + len(about["signal_names"])
        if len(body) != 8 * rows * (columns - 1):
            raise ValueError(f"{len(body)} bytes of {rows} rows")
        log = np.empty((rows, columns))
        log[:, 0] = (first + np.arange(rows)) * about["tick"]
        at = 0
        for name, (column, shape) in there.items():
            if name != "time":
                size = int(np.prod(shape))
                values = _values(body[at : at + 8 * rows * size], rows, size, name)
                log[:, column : column + size] = values
                at += 8 * rows * size
        signals = np.frombuffer(body[at:], "u1").reshape(columns - width, 8, rows).transpose(0, 2, 1)
        log[:, width:] = np.ascontiguousarray(signals).view("<f8").reshape(columns - width, rows).T
        return trajectory_from(about, log)
    except (OSError, EOFError, KeyError, TypeError, ValueError, AttributeError, OverflowError, MemoryError,
            RecursionError, lzma.LZMAError, msgspec.ValidationError) as error:  # fmt: skip
        raise InputError(f"{path}: not a trajectory: {why(error)}; remove it to have it simulated again") from None


def _columns(about: dict[str, Any]) -> tuple[Columns, int]:
    """Where each quantity stands in a log, and how wide that is without a law's own signals."""
    robot = robot_from(about.get("robot"), about.get("tree"))
    return columns_of(robot), width_of(robot)


def _packed(values: np.ndarray, name: str) -> bytes:
    """Values (n, width) as bytes, the low bytes of a column first."""
    scaled = np.clip(values / RESOLUTION.get(name, 1.0), -_LARGEST, _LARGEST)
    whole = np.where(np.isfinite(values), np.rint(np.nan_to_num(scaled)), _LOST).astype(np.int64)
    for _ in range(2 if name in _TWICE else 1):
        whole = np.diff(whole, axis=0, prepend=np.zeros((1, whole.shape[1]), np.int64))
    columns = np.ascontiguousarray(whole.T.astype("<i8"))
    return np.ascontiguousarray(columns.view("u1").reshape(*columns.shape, 8).transpose(0, 2, 1)).tobytes()


def _exact(values: np.ndarray) -> bytes:
    """Values (n, width) whose resolution nobody knows, bit by bit."""
    columns = np.ascontiguousarray(values.T.astype("<f8"))
    return np.ascontiguousarray(columns.view("u1").reshape(*columns.shape, 8).transpose(0, 2, 1)).tobytes()


def _values(data: bytes, rows: int, width: int, name: str) -> np.ndarray:
    """Unpacks an array (rows, width) that `_packed` packed."""
    planes = np.frombuffer(data, "u1").reshape(width, 8, rows).transpose(0, 2, 1)
    whole = np.ascontiguousarray(planes).view("<i8").reshape(width, rows).T.astype(np.int64)
    for _ in range(2 if name in _TWICE else 1):
        whole = np.cumsum(whole, axis=0)
    return np.where(whole == _LOST, np.nan, whole * RESOLUTION.get(name, 1.0))


def _unpacked(data: bytes) -> tuple[bytes, bytes]:
    """Head and body of a stream, neither of them larger than any that was written."""
    reader = lzma.LZMADecompressor(format=lzma.FORMAT_XZ, memlimit=_MEMORY)
    start = reader.decompress(data, max_length=_MOST_HEAD)
    if b"\n" not in start:
        raise ValueError("no head")
    head, _, rest = start.partition(b"\n")
    about = json.loads(head)
    rows, signals, width = about["rows"], len(about["signal_names"]), _columns(about)[1]
    if not (isinstance(rows, int) and rows > 0 and rows * (width + signals) <= MOST_ROWS * WIDTH):
        raise ValueError(f"{rows} rows of {signals} signals")
    parts, total = [rest], len(rest)
    wanted = 8 * rows * (width - 1 + signals) + 1  # one byte more than there may be shows that there is more
    while total < wanted and not reader.eof:
        part = reader.decompress(b"", max_length=wanted - total)
        if not part and reader.needs_input:
            raise EOFError("it ends too early")
        parts.append(part)
        total += len(part)
    return head, b"".join(parts)
