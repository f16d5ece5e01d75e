"""The demands of a walk on motors and gears."""

from __future__ import annotations

import numpy as np

from biped.measure.trajectory import Trajectory
from biped.robot.gravity import GRAVITY


def load(t: Trajectory, span: slice, distance: float) -> dict[str, float]:
    """Loads and electrical costs over a span of rows and a distance [m]; nothing of a robot without motors.

    The joint torques are what the gears deliver; the rotors' inertia and the joints' friction are the model's, so that
    the motors' torque is u / n, with the gear's loss on whichever side drives.
    """
    u, rate = t.u[span], t.rate[span]
    motor = t.robot.motor
    if motor is None or t.generalized:
        return {}
    rms = np.sqrt((u**2).mean(axis=0))
    current = motor.current(u, rate)
    heat = motor.resistance * current**2
    drawn = np.maximum(heat + motor.torque_constant * motor.ratio * rate * current, 0.0)
    weight = t.mass * GRAVITY * distance / t.tick
    line = motor.stall * (1.0 - np.sign(u) * rate / motor.free)
    return {
        "motor_load": float((rms / motor.rated).max()),
        "gear_load": float(np.abs(u).max() / motor.gear_peak),
        "beyond_gear": float((np.abs(u) > motor.gear_peak).any(axis=1).mean()),
        "beyond_line": float((np.abs(u) > line + 1e-9).any(axis=1).mean()),
        "cost_of_transport_heat": float(heat.sum() / weight),
        "cost_of_transport_electrical": float(drawn.sum() / weight),
    }
