"""models/*.xml as they are: parsed, checked, tried elsewhere first, and what is written in them.

Coordinates are x, z of the torso's centre of mass, pitch, then hip, knee and ankle leg by leg; the file's may be in
another order (`biped.robot.planar.order`). What MuJoCo steps is `biped.robot.planar.build`, what the controller
computes with `biped.robot.planar.controller_model`.
"""

from functools import lru_cache
from pathlib import Path

import mujoco
import numpy as np

from biped.base.errors import InputError
from biped.base.files import label, nearest
from biped.robot.holding import unknown_at_home
from biped.robot.planar.check import base_dofs, check_model, check_parts
from biped.robot.planar.controller_model import canonical
from biped.robot.planar.description import description_at, version_of
from biped.robot.planar.order import order_of
from biped.robot.planar.tree import Tree, tree_of
from biped.robot.safety import examine, packaged
from biped.robot.spec import check_sizes, compiled_spec, no_keyframe
from biped.robot.trial import tried


@lru_cache(maxsize=8)
def _checked(path: str, modified: float, described: float) -> tuple[mujoco.MjSpec, mujoco.MjModel]:
    """Parses, compiles and checks a model file once per version of it; first elsewhere if it may be anybody's."""
    file = Path(path)
    if not packaged(file):
        examine(file)
        tried(label(file), lambda: _survives(path))
    return _parsed(path)


def _parsed(path: str) -> tuple[mujoco.MjSpec, mujoco.MjModel]:
    name, robot = label(Path(path)), description_at(Path(path))

    def read() -> mujoco.MjSpec:
        spec = mujoco.MjSpec.from_file(path)
        check_parts(spec, name, robot)
        return spec

    spec, model = compiled_spec(Path(path), read)
    check_model(model, name, robot)
    return spec, model


def _survives(path: str) -> None:
    """Everything that is ever done with a model file, once."""
    _, model = _parsed(path)
    check_sizes(model, label(Path(path)))
    mujoco.mj_step(model, mujoco.MjData(model))
    canonical(path, 0.0, 0.0)


def checked_model(path: Path) -> mujoco.MjModel:
    """The compiled model file as it is; not to be written to."""
    return _checked(*version_of(path))[1]


def check_home(path: Path) -> None:
    """Makes sure that the home engine knows every part of a model.

    Raises:
        InputError: It would leave some out.
    """
    model = checked_model(path)
    if unknown := unknown_at_home(model, base_dofs(model, description_at(path))):
        raise InputError(f"engine: home has no equations for parts of {label(path)}: {'; '.join(unknown)}; take them "
                         "out, or write engine = 'mujoco'", "engine")  # fmt: skip


def spec_of(path: Path) -> mujoco.MjSpec:
    """A private copy of the parsed model file."""
    return _checked(*version_of(path))[0].copy()


def posture_of(path: Path, name: str) -> tuple[np.ndarray, tuple[str, ...]]:
    """A named start posture: joint coordinates (9,), canonical order, and the points that touch the ground.

    Raises:
        InputError: The model has no such keyframe, or names points that do not exist.
    """
    spec, model = _checked(*version_of(path))
    robot = description_at(path)
    keys = {key.name: key for key in spec.keys}
    if name not in keys:
        raise no_keyframe(path, name, list(keys))
    contacts = tuple(next((text.data for text in spec.texts if text.name == name), "").split())
    for contact in contacts:
        if contact not in robot.points:
            raise InputError(
                f"{label(path)}: text '{name}': '{contact}' is no contact point; {nearest(contact, list(robot.points))}"
            )
    return np.array(keys[name].qpos)[order_of(model, robot).joints], contacts


def tree_at(path: Path) -> Tree:
    """Lengths and masses written in a model file; not to be written to."""
    return _tree(*version_of(path))


@lru_cache(maxsize=8)
def _tree(path: str, modified: float, described: float) -> Tree:
    return tree_of(_checked(path, modified, described)[1], label(Path(path)), description_at(Path(path)))
