"""Actuators between a law and MuJoCo: bounded torques, and a first-order lag."""

from __future__ import annotations

import math

from biped.base.jit import kernel


@kernel
def actuate(command, limits, follow, wanted, target):
    """Brings actuators towards what a law commands; returns whether that is finite, and otherwise does nothing.

    Args:
        command: (n,) what the law returned.
        limits: (n,) [N m] bounds of torques; inf of other commands.
        follow: Fraction of the way that actuators go in a tick.
        wanted: (n,) where they are, overwritten.
        target: (n,) what MuJoCo takes commands from, overwritten.
    """
    for j in range(command.size):
        if not math.isfinite(command[j]):
            return False
    for j in range(command.size):
        bounded = min(max(command[j], -limits[j]), limits[j])
        wanted[j] += follow * (bounded - wanted[j])
        target[j] = wanted[j]
    return True
