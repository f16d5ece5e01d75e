"""A scenario becomes concrete runs: each with its own seed and every random draw resolved, replayable alone."""

from __future__ import annotations

import zlib
from pathlib import Path
from typing import NamedTuple

import numpy as np

from biped.control.record import ROWS
from biped.errors import InputError
from biped.files import locate, nearest
from biped.geometry import ABSOLUTE_FROM_JOINT, POINTS, absolute, from_absolute
from biped.model import posture_of, tree_at
from biped.posture import project
from biped.reading import read_gains
from biped.scenario import Gains, Scenario


class Run(NamedTuple):
    """One run, concrete.

    Attributes:
        scenario: What it belongs to.
        model: The model file.
        gains: The gait, complete.
        index: Number in the ensemble.
        seed: Its own seed.
        q: (9,) joint coordinates it starts from [m, rad].
        v: (9,) joint velocities it starts with.
        mass_factor: (9, 9) elementwise factors of the controller's M, or None.
        row_factor: (10, 9) elementwise factors of the controller's A, or None.
    """

    scenario: Scenario
    model: Path
    gains: Gains
    index: int
    seed: int
    q: np.ndarray
    v: np.ndarray
    mass_factor: np.ndarray | None
    row_factor: np.ndarray | None


def run_seed(seed: int, index: int) -> int:
    """The seed of run `index` of a scenario with `seed`."""
    return int(np.random.SeedSequence([seed, index]).generate_state(1)[0])


def stream(seed: int, name: str) -> np.random.Generator:
    """An independent stream of random numbers for one purpose, so that a new purpose never changes an old one."""
    return np.random.default_rng([seed, zlib.crc32(name.encode())])


class Plan:
    """The runs of a scenario; files are read once, draws are made when a run is asked for.

    Args:
        scenario: A checked scenario.

    Raises:
        InputError: Model, gait or start posture cannot be used.
    """

    def __init__(self, scenario: Scenario):
        self.scenario = scenario
        self.model = locate("models", scenario.model, "model")
        self.gains = read_gains(locate("controllers", scenario.controller, "controller"), scenario.gains)
        self.tree = tree_at(self.model)
        start = scenario.start
        if start.q is not None:
            self._posture, contacts = from_absolute(np.array(start.q)), ()
        else:
            self._posture, contacts = posture_of(self.model, start.posture)
        self._contacts = contacts if start.contacts is None else start.contacts
        for name in self._contacts:
            if name not in POINTS:
                raise InputError(f"start.contacts: '{name}' is no contact point; {nearest(name, list(POINTS))}")
        self._q = project(self.tree, self._posture, self._contacts) if start.settle else self._posture
        self.run(0)

    def __len__(self) -> int:
        return self.scenario.randomise.runs

    def run(self, index: int) -> Run:
        """Run `index` of the ensemble."""
        s = self.scenario
        seed = run_seed(s.seed, index)
        q = self._q
        if s.start.jitter > 0.0:
            q = absolute(q)
            q[2:] += s.start.jitter * stream(seed, "start.jitter").standard_normal(7)
            q = from_absolute(q)
            if s.start.settle:
                q = project(self.tree, q, ())
        random = s.randomise
        return Run(
            scenario=s,
            model=self.model,
            gains=self.gains,
            index=index,
            seed=seed,
            q=q,
            v=np.linalg.solve(ABSOLUTE_FROM_JOINT, np.array(s.start.v)),
            mass_factor=_factors(random.controller_mass_matrix, seed, "controller_mass_matrix", (9, 9)),
            row_factor=_factors(random.controller_constraints, seed, "controller_constraints", (ROWS, 9)),
        )


def _factors(deviation: float, seed: int, name: str, shape: tuple[int, int]) -> np.ndarray | None:
    if deviation == 0.0:
        return None
    return 1.0 + deviation * stream(seed, name).standard_normal(shape)
