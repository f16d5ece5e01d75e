"""Clips of runs, drawn by MuJoCo off the screen: `biped video`."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from biped.base.errors import InputError
from biped.show.film.canvas import off_screen
from biped.show.film.reel import check, wind
from biped.show.film.stage import FilmStage, Walker, walkers
from biped.show.model import visual_model
from biped.show.page.campaign import chosen
from biped.show.results_folder import ResultsFolder

SHAPE = 16 / 9


class Cut(NamedTuple):
    """How a clip is cut.

    Attributes:
        width: [px]; the height follows.
        rate: [Hz] of frames; None: 30 of an MP4, 20 of a GIF.
        start: [s] from here.
        end: [s] to here; None: to the end of the longest run.
    """

    width: int = 640
    rate: float | None = None
    start: float = 0.0
    end: float | None = None


def film(results: Sequence[Path], out: Path, cut: Cut, ghost: bool = False, only: int | None = None) -> int:
    """Writes a clip of one or two runs.

    Args:
        results: Results folders; of a campaign, the walker of median speed.
        out: The file, *.mp4 or *.gif.
        cut: How it is cut.
        ghost: Draw the second run as a shadow over the first, not beside it.
        only: Number of the run, where folders hold several.

    Returns:
        The number of frames.

    Raises:
        InputError: A folder holds no results, nothing here can draw or encode, or the file cannot be written.
    """
    check(out)
    rate = cut.rate or (20.0 if out.suffix.lower() == ".gif" else 30.0)
    _bounds(cut, rate, len(results), ghost)
    shown = walkers([_run(path, only) for path in results], ghost)
    last = max(float(walker.run.time[-1]) for walker in shown)
    end = last if cut.end is None else min(cut.end, last)
    if end <= cut.start:
        raise InputError(f"--from {cut.start:g}: expected a time before the end of the run, {last:g} s")
    times = np.arange(cut.start, end, 1.0 / rate)
    width, height = 2 * (cut.width // 2), 2 * round(cut.width / SHAPE / 2)
    stage = FilmStage(shown, rate)
    with off_screen(stage.model, width, height) as drawn:
        wind(out, _frames(stage, drawn, shown, times), width, height, rate)
    return len(times)


def _frames(stage: FilmStage, drawn, shown: Sequence[Walker], times: np.ndarray) -> Iterator[np.ndarray]:
    for time in times:
        walker = shown[0]
        row = int(np.clip(round((time - walker.run.time[0]) / walker.run.tick), 0, len(walker.run) - 1))
        names = ["time", "speed", *(["beside" if not walker.ghost else "ghost" for walker in shown[1:]])]
        values = [f"{time:5.2f} s", f"{walker.speed[row]:5.2f} m/s", *(other.name for other in shown[1:])]
        yield drawn.draw(stage.at(float(time)), "\n".join(names), "\n".join(values))


def _run(path: Path, only: int | None):
    """Name, trajectory and model of a results folder's run."""
    kept = ResultsFolder(path)
    rows = {row["index"]: row for row in kept.result["runs"]}
    if only is not None and len(rows) > 1 and only not in rows:
        raise InputError(f"--only {only}: expected the number of a run of {path}, {min(rows)} … {max(rows)}")
    index = only if only is not None and only in rows else chosen(list(rows.values()))[0][1]["index"]
    trajectory = kept.trajectory(index)
    if trajectory is None:
        raise InputError(kept.again(index))
    scenario = kept.plan.run(index).scenario
    model = visual_model(kept.plan.run(index).model, scenario)
    name = kept.result["scenario"] if len(rows) == 1 else f"{kept.result['scenario']}, run {index}"
    return name, trajectory, model


def _bounds(cut: Cut, rate: float, runs: int, ghost: bool) -> None:
    if runs > 2:
        raise InputError(f"video: expected one run or two, got {runs}")
    if ghost and runs != 2:
        raise InputError("--ghost: expected two runs, the second of which is the ghost")
    if not 64 <= cut.width <= 3840:
        raise InputError(f"--width {cut.width}: expected 64 … 3840 pixels")
    if not (math.isfinite(rate) and 1.0 <= rate <= 120.0):
        raise InputError(f"--fps {rate:g}: expected 1 … 120")
    if not (math.isfinite(cut.start) and cut.start >= 0.0):
        raise InputError(f"--from {cut.start:g}: expected a time [s] from 0 on")
    if cut.end is not None and not cut.end > cut.start:
        raise InputError(f"--to {cut.end:g}: expected a time [s] after --from")
