"""The random force of a run as pushes of constant force: what engines apply."""

import math

import numpy as np
from msgspec.structs import replace

from biped.scenario.keys import Scenario
from biped.scenario.normals import NormalStream
from biped.scenario.push import Push
from biped.scenario.vary import stream

PIECES = 10
"""In a correlation time."""


def disturbed(s: Scenario, seed: int) -> Scenario:
    """The scenario of a run with its random force among the pushes.

    The process is sampled exactly: x' = ρ x + √(1 − ρ²) z with ρ = exp(−h / τ) from piece to piece of h, and
    stationary from the first (D. T. Gillespie, Phys. Rev. E 54:2084, 1996).

    Args:
        s: The scenario.
        seed: The run's, from which the force is drawn: twice the strength is twice the same force.
    """
    given = s.disturbance
    if given is None:
        return s
    start, z = piece_times(s), piece_normals(s, seed)
    rho = math.exp(-(start[1] - start[0]) / given.correlation) if len(start) > 1 else 0.0
    force = np.empty_like(z)
    force[0] = z[0]
    for k in range(1, len(z)):
        force[k] = rho * force[k - 1] + math.sqrt(1.0 - rho * rho) * z[k]
    force *= np.array(given.force)
    ends = np.append(start[1:], s.duration)
    pushes = (
        Push(at=float(a), duration=float(b - a), force=tuple(map(float, one)), body=given.body)
        for a, b, one in zip(start, ends, force, strict=True)
    )
    return replace(s, push=(*s.push, *pushes))


def piece_times(s: Scenario) -> np.ndarray:
    """(n,) [s] at which the pieces of a scenario's random force begin, whole ticks; empty without one."""
    if s.disturbance is None:
        return np.empty(0)
    tick = 1.0 / s.simulation.control_rate
    each = max(1, round(s.disturbance.correlation / PIECES / tick))
    first, count = round(s.disturbance.at / tick), round(s.duration / tick)
    return np.arange(first, max(count, first + 1), each) * tick


def piece_normals(s: Scenario, seed: int) -> np.ndarray:
    """(n, directions) normal numbers that the pieces of a run's random force are made of; empty without one."""
    start = piece_times(s)
    rng = stream(seed, "disturbance")
    size = (len(start), len(s.disturbance.force) if s.disturbance else 0)
    return rng.standard_normal(size, start) if isinstance(rng, NormalStream) else rng.standard_normal(size)
