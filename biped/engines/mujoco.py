"""MuJoCo's compliant contacts, for any robot; the thesis's law walks seven links and a free base in compiled loops."""

from functools import partial
from typing import Any

from biped.engines.loop import by_kind, drive
from biped.engines.native import without_clock
from biped.engines.planar import mujoco as planar
from biped.engines.plant import MujocoPlant, Watch
from biped.robot.run import Run


def simulate(run: Run, watch: Watch | None = None) -> Any:
    """Simulates a run to its end, a fall or a number that is not finite.

    Args:
        run: A concrete run.
        watch: Called after every tick, which are Python's then; the model has its visual geoms.

    Returns:
        The run's trajectory.

    Raises:
        InputError: A push names a body the model lacks, or the law cannot be used or misbehaves at the first tick.
    """
    return by_kind(run, partial(planar.simulate, watch=watch), partial(_of_any_kind, watch=watch))


def _of_any_kind(run: Run, watch: Watch | None) -> Any:
    with without_clock():
        return drive(MujocoPlant(run, watch))


def loop_of(run: Run) -> str:
    """How a run's ticks are looped over: compiled, or in Python."""
    return "in Python" if MujocoPlant(run).compiled is None else "compiled"
