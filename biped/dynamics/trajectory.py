"""What an integration leaves behind."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from biped.dynamics.reactions import Reactions, energies, reactions
from biped.dynamics.system import ConstrainedSystem


@dataclass(frozen=True, eq=False)
class Trajectory:
    """A motion, in K samples.

    Attributes:
        t: (K,) time [s].
        q: (K, n) coordinates.
        v: (K, n) velocities.
        phi: (K,) largest |Φ| of all steps since the sample before.
        phi_dot: (K,) largest |Φ̇| of all steps since the sample before.
        ratio: (K,) smallest pivot ratio of C at any stage since the sample before; small: near a singularity.
        rank: (K,) smallest rank of C at any stage since the sample before.
        work: (K, k) work [J] since the start of every force named in the system's `powers`.
        steps: Steps taken.
        evaluations: Times the system's functions were evaluated.
        splits: Steps taken in unequal parts to keep away from a singularity.
        leaps: Steps across or out of a singular position (`leap`), tried ones included.
        refused: Steps an adaptive scheme did again.
        structural_rank: Rank of the constraints where they are not singular; no stage uses more rows.
        event: Name of the event that ended the motion, if one did.
        system: The system that moved.
    """

    t: np.ndarray
    q: np.ndarray
    v: np.ndarray
    phi: np.ndarray
    phi_dot: np.ndarray
    ratio: np.ndarray
    rank: np.ndarray
    work: np.ndarray
    steps: int
    evaluations: int
    splits: int
    leaps: int
    refused: int
    structural_rank: int
    event: str | None
    system: ConstrainedSystem = field(repr=False)

    @cached_property
    def reactions(self) -> Reactions:
        """Accelerations (K, n), multipliers (K, m) and constraint forces (K, n) at the samples."""
        return reactions(self.system, self.t, self.q, self.v, self.structural_rank)

    @property
    def acceleration(self) -> np.ndarray:
        """(K, n) v̇ at the samples."""
        return self.reactions.acceleration

    @property
    def multipliers(self) -> np.ndarray:
        """(K, m) λ at the samples, M v̇ = Q + Aᵀλ [N for a row in m, N m for one in rad]."""
        return self.reactions.multipliers

    @cached_property
    def _energies(self) -> tuple[np.ndarray, np.ndarray]:
        return energies(self.system, self.t, self.q, self.v)

    @property
    def kinetic(self) -> np.ndarray:
        """(K,) kinetic energy [J]."""
        return self._energies[0]

    @property
    def potential(self) -> np.ndarray:
        """(K,) potential energy [J]; nan if the system was given no potential."""
        return self._energies[1]

    @property
    def energy(self) -> np.ndarray:
        """(K,) kinetic and potential energy [J]."""
        return self.kinetic + self.potential

    @property
    def notes(self) -> tuple[str, ...]:
        """What should be known about how these numbers came about."""
        notes = []
        if self.system.derives_b_v:
            notes.append("b_v was not given: derived from A and b_q by differences, good to about 1e-11")
        if self.structural_rank < self.system.m:
            notes.append(
                f"{self.system.m} constraints of rank {self.structural_rank}: redundant ones share their force"
            )
        return tuple(notes)
