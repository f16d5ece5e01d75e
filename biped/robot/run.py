"""One run, concrete: everything random in it is drawn."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from biped.robot.law_factory import Factory
from biped.scenario.gains import Gains
from biped.scenario.keys import Scenario
from biped.scenario.origin import UNKNOWN, Origin


class Run(NamedTuple):
    """One run, concrete.

    Attributes:
        scenario: Its scenario with the values of its point and its draws.
        model: The model file.
        gains: The gait, complete.
        index: Number in the campaign.
        seed: Its own seed.
        values: What its point of the sweep and its draws changed, by key.
        q: (9,) joint coordinates it starts from [m, rad]; of a robot of another kind (nq,), in MuJoCo's order.
        v: (9,) joint velocities it starts with; likewise (nv,).
        mass_factor: (9, 9) elementwise factors of the controller's M, or None.
        row_factor: (10, 9) elementwise factors of the controller's A, or None.
        origin: Where the keys of its scenario were written.
        law: Makes the run's own law where one was handed over as an object (`biped.robot.law_factory`).
    """

    scenario: Scenario
    model: Path
    gains: Gains
    index: int
    seed: int
    values: dict[str, Any]
    q: np.ndarray
    v: np.ndarray
    mass_factor: np.ndarray | None
    row_factor: np.ndarray | None
    origin: Origin = UNKNOWN
    law: Factory | None = None
