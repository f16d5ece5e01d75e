"""A motion in samples, with its accelerations, multipliers and energies."""

from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np

from biped.dynamics import pattern
from biped.dynamics.orthogonal import RANK_TOLERANCE
from biped.dynamics.sparse import SPARSE_RATIO, Sparse, factor_sparse, solve_sparse, spilled
from biped.dynamics.system import ConstrainedSystem, Evaluation


class Reactions(NamedTuple):
    """Accelerations and forces in K states: M v̇ = Q + Aᵀλ."""

    acceleration: np.ndarray  # (K, n) v̇
    multipliers: np.ndarray  # (K, m) λ, in the units that their rows of Φ give them [N for m, N m for rad]
    force: np.ndarray  # (K, n) Aᵀλ, the generalized constraint force


def reactions(system: ConstrainedSystem, t: np.ndarray, q: np.ndarray, v: np.ndarray, rank: int) -> Reactions:
    """Solve M v̇ = Q + Aᵀλ, A v̇ = b_v in the states of a motion.

    Redundant rows share their force: of all λ that give the motion the one of least length is taken, rows scaled
    to length one in the metric of M. What single redundant supports carry is not decided by rigid bodies.

    Args:
        system: The system.
        t: (K,) time [s].
        q: (K, n) coordinates.
        v: (K, n) velocities.
        rank: Rank of the constraints where they are not singular.
    """
    K = len(t)
    out = Reactions(np.zeros((K, system.n)), np.zeros((K, system.m)), np.zeros((K, system.n)))
    full = system.n + system.m < pattern.LEAST_SIZE or rank < system.m
    tables = None if full else pattern.plan(*pattern.find(system, t[0], q[0], v[0]))
    for k in range(K):
        e = system.evaluate(t[k], q[k], v[k])
        found = _few(e, tables) if tables is not None and tables.use.size else None
        out.acceleration[k], out.multipliers[k] = found or _full(e, rank)
        out.force[k] = e.A.T @ out.multipliers[k]
    return out


def _few(e: Evaluation, K: Sparse) -> tuple[np.ndarray, np.ndarray] | None:
    """v̇ and λ where M and A have few entries; None if they cannot be trusted."""
    n, none = e.Q.size, np.zeros(0)
    if spilled(e.M, K.M) or spilled(e.A, K.A) or not factor_sparse(e.M, e.A, K) > SPARSE_RATIO:
        return None
    acceleration = np.zeros(n)
    solve_sparse(e.M, e.A, e.Q, e.b_v, 0.0 * e.b_v, 0.0, K, acceleration, none)
    return acceleration, -K.x[0, K.place[n:], 0]


def _full(e: Evaluation, rank: int) -> tuple[np.ndarray, np.ndarray]:
    """v̇ and λ by a singular value decomposition of C = A R⁻¹, rows scaled to length one."""
    L = np.linalg.cholesky(e.M)
    free = np.linalg.solve(L, e.Q)  # R a
    if e.b_v.size == 0:
        return np.linalg.solve(L.T, free), np.zeros(0)
    C = np.linalg.solve(L, e.A.T).T
    length = np.linalg.norm(C, axis=1)
    length[length <= RANK_TOLERANCE * length.max()] = np.inf
    U, s, V = np.linalg.svd(C / length[:, None], full_matrices=False)
    used = slice(0, min(rank, int((s > RANK_TOLERANCE * s[0]).sum())))
    gap = e.b_v - C @ free
    y = (U[:, used].T @ (gap / length)) / s[used]
    multipliers = (U[:, used] @ (y / s[used])) / length
    return np.linalg.solve(L.T, free + V[used].T @ y), multipliers


def energies(system: ConstrainedSystem, t: np.ndarray, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Kinetic and potential energy (K,) [J] of the states of a motion; potential nan if none was given."""
    kinetic = [0.5 * v[k] @ system.evaluate(t[k], q[k], v[k]).M @ v[k] for k in range(len(t))]
    potential = [system.potential_energy(t[k], q[k], v[k]) for k in range(len(t))]
    return np.array(kinetic), np.array(potential)


@dataclass(frozen=True, eq=False)
class Solution:
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
        """Warnings about how these numbers came about."""
        notes = []
        if self.system.derives_b_v:
            notes.append("b_v was not given: derived from A and b_q by differences, good to about 1e-11")
        if self.structural_rank < self.system.m:
            notes.append(
                f"{self.system.m} constraints of rank {self.structural_rank}: redundant ones share their force"
            )
        return tuple(notes)
