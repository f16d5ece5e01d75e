"""Time-stepping schemes: a Runge–Kutta tableau and what is done about the constraints' drift."""

from dataclasses import dataclass, field, replace
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from biped.base.errors import InputError
from biped.dynamics import dop853
from biped.dynamics.collocation import NODES
from biped.dynamics.reference import by_reference

LEAST_RTOL = 1e-14
"""Relative tolerance below which every step would fail: rounding alone is larger."""


SETTLE = 0.1
"""Pivot ratio below which the stages of `RK8` are put onto the constraints, or leapt over."""


class Correction(IntEnum):
    """Ways of a scheme to correct the error Φ, Φ̇ that a step leaves behind."""

    NONE = 0
    """Nothing, as in (2.17)."""
    EMBEDDED = 1
    """−WΦ and −WΦ̇ of the step's start, once per step, as in (2.20)–(2.21)."""
    BAUMGARTE = 2
    """The force that makes Φ̈ + 2αΦ̇ + β²Φ = 0."""
    PROJECTED = 3
    """(2.17), then mass-orthogonal Newton iterations back onto Φ = 0 and Φ̇ = 0."""


@by_reference
class Tableau(NamedTuple):
    """An explicit Runge–Kutta method of s stages."""

    A: np.ndarray  # (s, s) strictly lower triangle
    b: np.ndarray  # (s,)
    c: np.ndarray  # (s,)
    E: np.ndarray  # (2, s) weights of two error estimates; zero without an embedded pair


class Settings(NamedTuple):
    """The numbers of a scheme, as the compiled loop reads them."""

    correction: int
    alpha: float
    beta: float
    energy: int
    rtol: float
    atol: float
    split: float
    settle: float


def _tableau(rows: list[list[float]], b: list[float], c: list[float]) -> Tableau:
    s = len(b)
    A = np.zeros((s, s))
    for i, row in enumerate(rows):
        A[i, : len(row)] = row
    return Tableau(A, np.array(b), np.array(c), np.zeros((2, s)))


@dataclass(frozen=True, eq=False)
class Scheme:
    """One way to step: start from `EULER`, `RK4` or `RK8` and derive others with the methods below.

    Attributes:
        name: Name in tables and messages.
        order: Order of convergence on smooth motion.
        tableau: The Runge–Kutta method.
        correction: What is done about drift.
        alpha: Baumgarte's α [1/s].
        beta: Baumgarte's β [1/s].
        energy: Scale v after each step so that the total energy stays that of the start.
        rtol: Relative error a step may make; 0 with `atol` 0 means fixed steps.
        atol: Absolute error a step may make, in the units of q and v.
        split: Pivot ratio of a stage below which the step is taken in unequal parts; 0 switches it off. Schemes that
            settle leap instead.
        settle: Pivot ratio below which every stage is put onto the constraints before it is used, and a step that
            shows a singular position is taken by a leap (`leap`); 0: stages are used as they come. Next to such a
            position the constraint force is a quotient of two small numbers, and what a stage is off the
            constraints by, no more than h², is not small beside them.
    """

    name: str
    order: int
    tableau: Tableau = field(repr=False)
    correction: Correction = Correction.EMBEDDED
    alpha: float = 0.0
    beta: float = 0.0
    energy: bool = False
    rtol: float = 0.0
    atol: float = 0.0
    split: float = 1e-4
    settle: float = 0.0

    def uncorrected(self) -> "Scheme":
        """The same method on (2.17): nothing is done about drift."""
        return replace(self, name=f"{self.name}, uncorrected", correction=Correction.NONE)

    def baumgarte(self, alpha: float, beta: float) -> "Scheme":
        """The same method with Baumgarte's stabilisation, Φ̈ + 2αΦ̇ + β²Φ = 0 [1/s]."""
        if not (alpha >= 0.0 and beta >= 0.0 and np.isfinite(alpha + beta)):
            raise InputError(f"Baumgarte's alpha and beta must be finite and not negative, not {alpha}, {beta}")
        return replace(
            self,
            name=f"{self.name}, Baumgarte {alpha:g}",
            correction=Correction.BAUMGARTE,
            alpha=alpha,
            beta=beta,
        )

    def projected(self) -> "Scheme":
        """The same method on (2.17), each step projected back onto the constraints."""
        return replace(self, name=f"{self.name}, projected", correction=Correction.PROJECTED)

    def energy_scaled(self) -> "Scheme":
        """The same scheme holding the energy of the start; for conservative systems with a potential."""
        return replace(self, name=f"{self.name}, energy scaled", energy=True)

    def adaptive(self, rtol: float, atol: float | None = None) -> "Scheme":
        """The same method with steps chosen so that each errs by less than `atol + rtol·|y|`.

        Args:
            rtol: Relative tolerance.
            atol: Absolute tolerance; the relative one if not given.

        Raises:
            InputError: The tableau has no embedded pair, or a tolerance is below what rounding allows.
        """
        atol = rtol if atol is None else atol
        if not self.tableau.E.any():
            raise InputError(f"{self.name} has no embedded pair: adaptive steps need RK8")
        if not (rtol >= LEAST_RTOL and atol > 0.0 and np.isfinite(rtol + atol)):
            raise InputError(
                f"tolerances must be finite and at least rtol={LEAST_RTOL} and atol > 0, not rtol={rtol}, atol={atol}"
            )
        return replace(self, name=f"{self.name}, adaptive {rtol:g}", rtol=rtol, atol=atol)

    def without_splitting(self) -> "Scheme":
        """The same scheme with every step in one piece, however close a singularity, and its stages as they come."""
        return replace(self, split=0.0, settle=0.0)

    @property
    def rows(self) -> int:
        """Rates that a step needs room for: its stages', or those of a leap over a singular position."""
        stages = self.tableau.b.size
        return max(stages, NODES + 1) if self.settle > 0.0 else stages

    def settings(self) -> Settings:
        """Settings that the compiled loop reads."""
        return Settings(
            int(self.correction),
            float(self.alpha),
            float(self.beta),
            int(self.energy),
            float(self.rtol),
            float(self.atol),
            float(self.split),
            float(self.settle),
        )


EULER = Scheme("Euler", 1, _tableau([[]], [1.0], [0.0]))
"""Forward Euler, (2.20)–(2.21)."""

RK4 = Scheme(
    "RK4",
    4,
    _tableau([[], [0.5], [0.0, 0.5], [0.0, 0.0, 1.0]], [1 / 6, 1 / 3, 1 / 3, 1 / 6], [0.0, 0.5, 0.5, 1.0]),
)
"""The classical method, the thesis's own."""

RK8 = Scheme("RK8", 8, Tableau(dop853.A, dop853.B, dop853.C, np.vstack((dop853.E5, dop853.E3))), settle=SETTLE)
"""Twelve stages of order 8 (Dormand and Prince)."""
