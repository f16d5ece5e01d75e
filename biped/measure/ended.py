"""What every run says of its end, whatever walked."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from biped.scenario.robot import Walked


class Kind(Protocol):
    """What walked."""

    @property
    def walked(self) -> Walked:
        """What counts as walking."""
        ...


class Ended(Protocol):
    """A run that is over.

    Attributes as of `biped.measure.trajectory.Trajectory`.
    """

    @property
    def end(self) -> str: ...  # noqa: D102
    @property
    def cause(self) -> str: ...  # noqa: D102
    @property
    def tick(self) -> float: ...  # noqa: D102
    @property
    def sampled(self) -> bool: ...  # noqa: D102
    @property
    def warnings(self) -> dict[str, int]: ...  # noqa: D102
    @property
    def robot(self) -> Kind: ...  # noqa: D102
    @property
    def time(self) -> np.ndarray: ...  # noqa: D102
    @property
    def x(self) -> np.ndarray: ...  # noqa: D102
    @property
    def changes(self) -> tuple[float, ...]: ...  # noqa: D102
    def __len__(self) -> int: ...
