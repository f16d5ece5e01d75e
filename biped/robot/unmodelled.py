"""Realities that nobody modelled: random functions that are drawn for a run and fixed in it.

Joint torques are a function of the joints' state, friction and softness of the ground are functions of the place on it.
Each is a sum of cosines of random frequencies and phases, which is a draw of a Gaussian process with a squared
exponential covariance (A. Rahimi, B. Recht, NIPS 2007): smooth, bounded, and as random in one joint as in another.
"""

import math
from typing import NamedTuple

import numpy as np

from biped.base.errors import InputError
from biped.base.jit import kernel
from biped.base.typed import LARGEST
from biped.robot.run import Run
from biped.scenario.vary import stream

TERMS = 64
"""Cosines in the sum."""
RATE = 0.1
"""[s] A rate counts as the angle that a joint covers in this time."""


class Unmodelled(NamedTuple):
    """The torques of a run with n joints.

    Attributes:
        frequencies: (TERMS, 2 n) [1/rad, s/rad] of angles and rates.
        phases: (TERMS,) [rad].
        torques: (n, TERMS) [N m] of the cosines.
        limits: (n,) [N m] of the joints' torques.
        added: (n,) [N m] what was added last, live.
    """

    frequencies: np.ndarray
    phases: np.ndarray
    torques: np.ndarray
    limits: np.ndarray
    added: np.ndarray


def unmodelled_of(run: Run) -> tuple[Unmodelled, ...]:
    """The torques of a run, or () where its scenario asks for none: a tuple's length is part of its type.

    Args:
        run: The run; its seed fixes the function, of which twice the strength is twice the same.

    Raises:
        InputError: A joint has no limit that the strength could be a share of.
    """
    keys, limits = run.scenario.truth.unmodelled, np.array(run.torque_limits)
    if keys.torque == 0.0:
        return ()
    for name, limit in zip(run.robot.actuators, limits, strict=True):
        if limit >= LARGEST:
            raise InputError(
                f"truth.unmodelled.torque: expected 0, or a limit of '{name}' that it is a share of: give "
                "actuation.torque_limit", "truth.unmodelled.torque",
            )  # fmt: skip
    rng, n = stream(run.seed, "unmodelled"), len(limits)
    frequencies = rng.standard_normal((TERMS, 2 * n)) / keys.angle
    frequencies[:, n:] *= RATE
    phases = rng.uniform(0.0, 2.0 * math.pi, TERMS)
    torques = math.sqrt(2.0 / TERMS) * keys.torque * limits[:, None] * rng.standard_normal((n, TERMS))
    return (Unmodelled(frequencies, phases, torques, limits, np.zeros(n)),)


@kernel
def torques_at(made, angles, rates):
    """Writes the torques of a state into `added`.

    Args:
        made: `Unmodelled`.
        angles: (n,) [rad] of the joints.
        rates: (n,) [rad/s].
    """
    n = angles.size
    for j in range(n):
        made.added[j] = 0.0
    for i in range(made.phases.size):
        phase = made.phases[i]
        for j in range(n):
            phase += made.frequencies[i, j] * angles[j] + made.frequencies[i, n + j] * rates[j]
        cosine = math.cos(phase)
        for j in range(n):
            made.added[j] += made.torques[j, i] * cosine


class Patches(NamedTuple):
    """The ground of a run: two sums, which are the logarithms of factors.

    Attributes:
        frequencies: (TERMS, 2) [1/m] along the ground and to the left.
        phases: (TERMS,) [rad].
        sizes: (2, TERMS) of the cosines in the logarithms of the factors of friction and of contact time.
        least: [s] below which no contact time falls.
    """

    frequencies: np.ndarray
    phases: np.ndarray
    sizes: np.ndarray
    least: float


def patches_of(run: Run) -> tuple[Patches, ...]:
    """The ground of a run, or () where its scenario asks for none: a tuple's length is part of its type.

    Args:
        run: The run; its seed fixes the functions, of whose logarithms twice the strength is twice the same.
    """
    keys = run.scenario.truth.unmodelled
    if not keys.patchy:
        return ()
    rng = stream(run.seed, "unmodelled ground")
    frequencies = rng.standard_normal((TERMS, 2)) / keys.patch
    phases = rng.uniform(0.0, 2.0 * math.pi, TERMS)
    strengths = np.array([[keys.friction], [keys.softness]])
    sizes = math.sqrt(2.0 / TERMS) * strengths * rng.standard_normal((2, TERMS))
    return (Patches(frequencies, phases, sizes, 2.0 * run.scenario.simulation.timestep),)


@kernel
def factors_at(patches, x, y):
    """Factors of friction and of contact time at a place.

    Args:
        patches: `Patches`.
        x: [m] along the ground.
        y: [m] to the left.
    """
    friction, time = 0.0, 0.0
    for i in range(patches.phases.size):
        cosine = math.cos(patches.frequencies[i, 0] * x + patches.frequencies[i, 1] * y + patches.phases[i])
        friction += patches.sizes[0, i] * cosine
        time += patches.sizes[1, i] * cosine
    return math.exp(friction), math.exp(time)
