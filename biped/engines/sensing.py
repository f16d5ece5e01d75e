"""Sensors of a robot of any kind as compiled code reads them: late, noisy, rounded.

The same digits as `biped.control.sensors`, whose arrays these are.
"""

from typing import NamedTuple

import numpy as np

from biped.base.address import move
from biped.base.jit import inner_kernel
from biped.control.sensors import CoordinateSensors
from biped.engines.native import halves


class CompiledSensors(NamedTuple):
    """Sensors of a run, and what they measure.

    Attributes:
        q: (nq,) measured coordinates, live.
        v: (nv,) measured velocities, live.
        past_q: As of `CoordinateSensors`, and so are all that follow.
        past_v: Of it.
        taken: Of it.
        zeros: Of it.
        deviation: Of it.
        rate_deviation: Of it.
        exact: Of it.
        places: Of it.
        resolution: Of it.
        error: (nv,) by how much a tick's coordinates are off, work.
        integrate: Address of mj_integratePos.
        model: Address of the model.
        q_at: Address of `q`.
        error_at: Address of `error`.
    """

    q: np.ndarray
    v: np.ndarray
    past_q: np.ndarray
    past_v: np.ndarray
    taken: np.ndarray
    zeros: np.ndarray
    deviation: np.ndarray
    rate_deviation: np.ndarray
    exact: bool
    places: np.ndarray
    resolution: float
    error: np.ndarray
    integrate: int
    model: int
    q_at: int
    error_at: int


def sensing_of(sensors: CoordinateSensors) -> CompiledSensors | None:
    """Sensors for compiled code, or None where they must be read from Python: those with a gyro.

    Args:
        sensors: Of the run.
    """
    if sensors.gyro is not None or (native := halves(sensors.model)) is None:
        return None
    q, error = sensors.data.qpos, np.zeros(sensors.model.nv)
    return CompiledSensors(
        q, sensors.data.qvel, sensors.past_q, sensors.past_v, sensors.taken, sensors.zeros, sensors.deviation,
        sensors.rate_deviation, sensors.exact, sensors.places, sensors.resolution, error, native.integrate,
        sensors.model._address, q.ctypes.data, error.ctypes.data,
    )  # fmt: skip


@inner_kernel
def sense(s, q, v, noise):
    """Measures true coordinates (nq,) and velocities (nv,) of a tick, with noises (2, nv) of coordinates and rates."""
    kept, taken = s.past_q.shape[0], s.taken[0]
    newest, late = taken % kept, max(taken + 1 - kept, 0) % kept
    s.taken[0] = taken + 1
    for i in range(q.size):
        s.past_q[newest, i] = q[i]
        s.q[i] = s.past_q[late, i]
    for i in range(v.size):
        s.past_v[newest, i] = v[i]
        s.v[i] = s.past_v[late, i] + s.rate_deviation[i] * noise[1, i]
        s.error[i] = s.zeros[i] + s.deviation[i] * noise[0, i]
    if not s.exact:
        move(s.integrate, s.model, s.q_at, s.error_at, 1.0)
    if s.resolution > 0.0:
        for i in range(s.places.size):
            s.q[s.places[i]] = np.rint(s.q[s.places[i]] / s.resolution) * s.resolution
