"""Clips of runs, drawn by MuJoCo off the screen: `biped video`."""

import math
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import NamedTuple

import numpy as np

from biped.base.errors import InputError
from biped.show.film.camera import camera_of
from biped.show.film.canvas import Canvas, off_screen
from biped.show.film.reel import check, wind
from biped.show.film.stage import FilmedWalker, FilmStage, walkers
from biped.show.results_folder import run_of

SHAPE = 16 / 9
MOST = 6
"""Most runs of a clip."""
_ROOMY = 280
"""[px] of a picture's height from which words have more than a line."""


class Cut(NamedTuple):
    """How a clip is cut.

    Attributes:
        width: [px].
        height: [px]; None: as wide screens are.
        rate: [Hz] of frames; None: 30 of an MP4, 20 of a GIF.
        start: [s] from here.
        end: [s] to here; None: to the end of the longest run.
        slow: How many times slower than life.
        eye: Where it is seen from (`biped.show.film.camera`).
        ghost: Whether the second run is a shadow over the first, not beside it.
        apart: Whether every run has a picture of its own, side by side; more than two always have.
    """

    width: int = 640
    height: int | None = None
    rate: float | None = None
    start: float = 0.0
    end: float | None = None
    slow: float = 1.0
    eye: str = "three-quarters"
    ghost: bool = False
    apart: bool = False


def film(results: Sequence[Path], out: Path, cut: Cut, only: int | None = None) -> int:
    """Writes a clip of runs.

    Args:
        results: Results folders; of a campaign, the walker of median speed.
        out: The file, *.mp4 or *.gif.
        cut: How it is cut.
        only: Number of the run, where folders hold several.

    Returns:
        The number of frames.

    Raises:
        InputError: A folder holds no results, nothing here can draw or encode, or the file cannot be written.
    """
    check(out)
    rate = cut.rate or (20.0 if out.suffix.lower() == ".gif" else 30.0)
    camera = camera_of(cut.eye)
    _bounds(cut, rate, len(results))
    runs = [run_of(path, only) for path in results]
    pictures = [walkers([run], False) for run in runs] if cut.apart or len(runs) > 2 else [walkers(runs, cut.ghost)]
    last = max(walker.end for shown in pictures for walker in shown)
    end = last if cut.end is None else min(cut.end, last)
    if end <= cut.start:
        raise InputError(f"--from {cut.start:g}: expected a time before the end of the run, {last:g} s")
    times = np.arange(cut.start, end, 1.0 / (rate * cut.slow))
    height = 2 * round((cut.height or cut.width / SHAPE) / 2)
    width = 2 * (cut.width // len(pictures) // 2)
    with ExitStack() as stack:
        scenes = []
        for shown in pictures:
            stage = FilmStage(shown, rate * cut.slow, camera, width / height)
            scenes.append((shown, stage, stack.enter_context(off_screen(stage.model, width, height))))
        wind(out, _frames(scenes, times), width * len(pictures), height, rate)
    return len(times)


def _frames(scenes: Sequence[tuple[list[FilmedWalker], FilmStage, Canvas]], times: np.ndarray) -> Iterator[np.ndarray]:
    """Pictures side by side at every time; valid until the next."""
    short = len(scenes) > 1 or scenes[0][2].height < _ROOMY
    for time in times:
        drawn = [canvas.draw(stage.at(float(time)), *_words(shown, float(time), short))
                 for shown, stage, canvas in scenes]  # fmt: skip
        yield drawn[0] if len(drawn) == 1 else np.concatenate(drawn, axis=1)


def _words(shown: Sequence[FilmedWalker], time: float, short: bool) -> tuple[str, str]:
    """Names and values in the corner of a picture, which may have little room."""
    first = shown[0]
    row = int(np.clip(round((time - first.run.time[0]) / first.run.tick), 0, len(first.run) - 1))
    ended = time > first.run.time[-1] and first.run.end == "fell"
    speed = "fell" if ended else f"{first.speed[row]:5.2f} m/s"
    names = ["run", "time", "speed", *("beside" if not other.ghost else "ghost" for other in shown[1:])]
    values = [first.name, f"{time:5.2f} s", speed, *(other.name for other in shown[1:])]
    if short:
        return f"{first.name} {time:.2f} s", ""
    return "\n".join(names), "\n".join(values)


def _bounds(cut: Cut, rate: float, runs: int) -> None:
    if runs > MOST:
        raise InputError(f"video: expected at most {MOST} runs, got {runs}")
    if cut.ghost and (runs != 2 or cut.apart):
        raise InputError("--ghost: expected two runs in one picture, the second of which is the ghost")
    if not 64 <= cut.width <= 3840:
        raise InputError(f"--width {cut.width}: expected 64 … 3840 pixels")
    if cut.height is not None and not 36 <= cut.height <= 2160:
        raise InputError(f"--size: expected a height of 36 … 2160 pixels, got {cut.height}")
    if not (math.isfinite(rate) and 1.0 <= rate <= 120.0):
        raise InputError(f"--fps {rate:g}: expected 1 … 120")
    if not 0.1 <= cut.slow <= 100.0:
        raise InputError(f"--slow {cut.slow:g}: expected how many times slower than life, 0.1 … 100")
    if not (math.isfinite(cut.start) and cut.start >= 0.0):
        raise InputError(f"--from {cut.start:g}: expected a time [s] from 0 on")
    if cut.end is not None and not cut.end > cut.start:
        raise InputError(f"--to {cut.end:g}: expected a time [s] after --from")
