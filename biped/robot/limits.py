"""Torque limits of a run's actuators."""

from __future__ import annotations

from biped.base.errors import InputError
from biped.robot.robot import Robot
from biped.scenario.keys import Scenario


def torque_limits(robot: Robot, s: Scenario) -> tuple[float, ...]:
    """(nu,) [N m] torque limits of a run: the model file's, or the scenario's where that is less.

    Raises:
        InputError: The scenario has limits of other actuators.
    """
    asked, count = s.actuation.torque_limit, len(robot.drives)
    if isinstance(asked, tuple) and len(asked) != count:
        raise InputError(
            f"actuation.torque_limit: expected a number, or one for each of {count} actuators, got {len(asked)}",
            "actuation.torque_limit",
        )
    limits = asked if isinstance(asked, tuple) else (asked,) * count
    return tuple(min(drive.limit, float(limit)) for drive, limit in zip(robot.drives, limits, strict=True))
