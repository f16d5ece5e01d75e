"""Drake's contacts (SAP), for any robot: a second foreign judge, which no gait here was ever searched in.

Of a scenario's physics it uses the ground, the pushes, the truth about the robot and `simulation.timestep`. Contacts
are springs of stiffness mass / contact_time² that relax in 2 · damping_ratio · contact_time; the integrator, the cone
and the solver's settings are MuJoCo's and have no meaning here.
"""

from __future__ import annotations

from typing import Any

from biped.base.errors import InputError
from biped.engines.loop import by_kind
from biped.robot.run import Run

NEEDS = "engine: 'drake' needs Drake, which is not installed; install it with: pip install drake"


def simulate(run: Run) -> Any:
    """Simulates a run to its end, a fall or a number that is not finite.

    Args:
        run: A concrete run.

    Returns:
        The run's trajectory; forces are means over each tick.

    Raises:
        InputError: Drake is not installed or cannot simulate this, a push names a body the model lacks, or the law
            cannot be used or misbehaves at the first tick.
    """
    try:
        import pydrake  # noqa: F401  # pyright: ignore[reportMissingImports]
    except ImportError:
        raise InputError(NEEDS, "engine") from None
    from biped.engines.sap.robot import simulate_any, simulate_planar

    return by_kind(run, simulate_planar, simulate_any)
