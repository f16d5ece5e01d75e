"""Dials of a MuJoCo model: ways to change one physical cause of how a walker behaves in it.

Each edits the compiled model, or sets a key of the scenario where there is one for it.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import mujoco
import numpy as np

Edit = Callable[[mujoco.MjModel, float], None]
STEP = "simulation.timestep"


class Dial(NamedTuple):
    """A way to change a cause.

    Attributes:
        words: What a value of it is, with a place for the value.
        values: That are tried.
        edit: Changes the compiled model; or none, and the key does.
        key: Of the scenario.
        continuous: Whether it is turned further between them, on a logarithmic scale.
    """

    words: str
    values: tuple[Any, ...]
    edit: Edit | None = None
    key: str = ""
    continuous: bool = False


def _scale(*names: str) -> Edit:
    """Multiplies arrays of a model."""

    def edit(m: mujoco.MjModel, factor: float) -> None:
        for name in names:
            array = getattr(m, name)
            array[:] = array * factor

    return edit


def _constants(edit: Edit) -> Edit:
    """As an edit, and then all that follows from masses is computed anew."""

    def both(m: mujoco.MjModel, value: float) -> None:
        edit(m, value)
        mujoco.mj_setConst(m, mujoco.MjData(m))

    return both


def _contact_times(m: mujoco.MjModel, factor: float) -> None:
    for array in (m.pair_solref, m.geom_solref):
        positive = array[:, 0] > 0.0
        array[positive, 0] *= factor


def _damping_ratios(m: mujoco.MjModel, factor: float) -> None:
    for array in (m.pair_solref, m.geom_solref):
        array[array[:, 0] > 0.0, 1] *= factor


def _frictions(m: mujoco.MjModel, factor: float) -> None:
    m.pair_friction[:, :2] *= factor
    m.geom_friction[:, 0] *= factor


def _joints(m: mujoco.MjModel) -> np.ndarray:
    """Velocities of joints but those by which the base moves."""
    first = m.body_dofnum[1] + m.body_dofadr[1]
    return np.arange(first, m.nv)


def _add_damping(m: mujoco.MjModel, value: float) -> None:
    linear = m.dof_damping if m.dof_damping.ndim == 1 else m.dof_damping[:, 0]
    linear[_joints(m)] += value


def _no_damping(m: mujoco.MjModel, factor: float) -> None:
    m.dof_damping[_joints(m)] *= factor


def _add_armature(m: mujoco.MjModel, value: float) -> None:
    m.dof_armature[_joints(m)] += value


def _stop_times(m: mujoco.MjModel, factor: float) -> None:
    m.jnt_solref[m.jnt_solref[:, 0] > 0.0, 0] *= factor


def _without_stops(m: mujoco.MjModel, _: float) -> None:
    m.jnt_limited[:] = 0


def _base_mass(m: mujoco.MjModel, factor: float) -> None:
    heaviest = int(np.argmax(m.body_mass))
    m.body_mass[heaviest] *= factor
    m.body_inertia[heaviest] *= factor


_FACTORS = (0.1, 0.25, 0.5, 2.0, 4.0, 10.0)
_NEAR = (0.8, 0.9, 0.97, 1.03, 1.1, 1.25)
_SOME = (0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0)

CAUSES: dict[str, tuple[Dial, ...]] = {
    "contact time": (Dial("contact time × {:.3g}", _FACTORS, _contact_times, continuous=True),),
    "contact damping": (Dial("damping ratio × {:.3g}", _FACTORS, _damping_ratios, continuous=True),),
    "friction": (Dial("friction × {:.3g}", (0.02, 0.06, *_FACTORS), _frictions, continuous=True),),
    "joint damping": (
        Dial("{:.3g} N m s/rad in every joint besides", _SOME, _add_damping, continuous=True),
        Dial("damping × {:.3g}", (0.0, 0.5, 2.0), _no_damping),
    ),
    "armature": (
        Dial("{:.3g} kg m² at every joint besides", _SOME[:-1], _constants(_add_armature), continuous=True),
        Dial("armature × {:.3g}", (0.0, 0.5, 2.0), _constants(_scale("dof_armature"))),
    ),
    "joint limits": (
        Dial("limits' time × {:.3g}", _FACTORS, _stop_times, continuous=True),
        Dial("no limits", (0.0,), _without_stops),
    ),
    "gravity": (Dial("gravity × {:.4g}", _NEAR, lambda m, f: m.opt.gravity.__imul__(f), continuous=True),),
    "mass": (
        Dial("all masses × {:.4g}", _NEAR, _constants(_scale("body_mass", "body_inertia")), continuous=True),
        Dial("the heaviest link's mass × {:.4g}", _NEAR, _constants(_base_mass), continuous=True),
    ),
    "step": (Dial("step × {:g}", (0.1, 0.2, 0.25, 0.5, 2.0, 4.0, 5.0, 10.0), key=STEP),),
    "integrator": (Dial("{}", ("Euler", "implicitfast", "implicit", "RK4"), key="simulation.integrator"),),
    "solver": (
        Dial("{}", ("Newton", "CG", "PGS"), key="simulation.solver"),
        Dial("at most {} iterations", (1, 2, 3, 5, 10, 100), key="simulation.iterations"),
    ),
    "cone": (
        Dial("{}", ("elliptic", "pyramidal"), key="simulation.cone"),
        Dial("impratio {:g}", (1.0, 100.0), key="simulation.impratio"),
    ),
}  # fmt: skip
"""Physical causes that are changed, one at a time. Keys of the scenario where there is one for it."""
