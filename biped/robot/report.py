"""The robot in a model file, recognised before anything of it is run."""

from pathlib import Path
from typing import Any, NamedTuple

import msgspec
import mujoco
import numpy as np

from biped.base.errors import InputError
from biped.base.files import description_of, is_file, label, locate, read_toml
from biped.robot.anatomy import ANKLE, HIP, INVERSION, KNEE, Anatomy, anatomy_of
from biped.robot.recognise import looked_at
from biped.robot.robot import Robot
from biped.robot.spec import parsed
from biped.scenario.general import KIND, differing
from biped.scenario.keys import Simulation
from biped.scenario.laws import BUILT_IN, THESIS
from biped.scenario.robot import Described
from biped.scenario.valid import convert, known_keys


class ModelReport(NamedTuple):
    """Everything recognised in a model file.

    Attributes:
        file: It.
        description: The file that describes it; None: everything was recognised.
        robot: What it is; None if it cannot be run.
        faults: All that is wrong, and what to write.
        not_planar: Why the thesis's law cannot walk it in the plane; empty if it can.
        laws: The laws of this package that it runs with as a robot of any kind, beside a law of one's own.
        notes: What of the file was left out, without harm.
        physics: What the file asks for and a run does otherwise by default; empty where they agree.
        parts: Torso, thighs, shanks, feet, soles and hinges of a biped in space, in words; empty of any other.
        not_spatial: Why the thesis's law for any biped cannot walk it; empty if it can.
        held: Joints of such a biped that neither base nor legs need: arms, waist, head.
        leg: [m] length of its straight leg; 0 of any other.
    """

    file: Path
    description: Path | None
    robot: Robot | None
    faults: tuple[str, ...]
    not_planar: str
    laws: tuple[str, ...]
    notes: tuple[str, ...]
    physics: str
    parts: dict[str, str]
    not_spatial: str
    held: tuple[str, ...] = ()
    leg: float = 0.0

    @property
    def in_the_plane(self) -> bool:
        """Whether nothing can push it to the side."""
        return self.robot is not None and self.robot.planar

    def as_dict(self) -> dict[str, Any]:
        """Plain data, as `--json` prints it."""
        return {
            "file": label(self.file), "description": None if self.description is None else label(self.description),
            "faults": list(self.faults), "seven_links": not self.not_planar, "laws": list(self.laws),
            "notes": list(self.notes), "physics": self.physics,
            "parts": self.parts, "not_spatial": self.not_spatial,
            "robot": None if self.robot is None else msgspec.to_builtins(self.robot) | {"mass": self.robot.mass},
        }  # fmt: skip


def look(name: str) -> ModelReport:
    """Everything recognised in a model file.

    Args:
        name: Name in models/, or path of an MJCF or URDF file.

    Raises:
        InputError: There is no such file, it is no model at all, or its description says what it cannot.
    """
    path = locate("models", name, "model")
    own = path.with_suffix(".toml")
    data = read_toml(own) if is_file(own) else {}
    general = data.pop("kind", None) == KIND
    data.pop("scenario", None)
    table = Described()
    if general:

        def fail(key: str, what: str) -> InputError:
            return InputError(f"{label(own)}: {key}: {what}")

        known_keys(data, Described, "", fail)
        table = convert(data, Described, fail)
    robot, faults, notes = looked_at(path, table)
    laws, parts, not_spatial, held, leg = tuple(name for name in BUILT_IN if name != THESIS), {}, "", (), 0.0
    physics = "" if robot is None else differing(path, Simulation())
    if robot is None:
        laws = ()
    else:
        model = parsed(path, table)[1]
        try:
            anatomy = anatomy_of(model, robot)
            parts = _parts(model, anatomy, robot.planar)
            held = tuple(model.joint(joint).name for joint in anatomy.trunk[: len(anatomy.trunk) - anatomy.shared])
            laws, leg = (THESIS, *laws), anatomy.leg
        except InputError as error:
            not_spatial = str(error)
    return ModelReport(
        path,
        own if general else None,
        robot,
        faults,
        _planar(path, general),
        laws,
        notes,
        physics,
        parts,
        not_spatial,
        held,
        leg,
    )


def _parts(model: mujoco.MjModel, anatomy: Anatomy, planar: bool) -> dict[str, str]:
    """Parts of a biped, by what they are."""
    above = ", ".join(model.joint(joint).name for joint in reversed(anatomy.trunk))
    out = {
        "torso": f"{model.body(anatomy.torso).name}; a straight leg is {anatomy.leg:.3g} m long from the last hip "
                 "joint to the sole",
        "held": f"law = 'thesis' holds these joints by springs: {above}" if above else "no other joints",
    }  # fmt: skip
    for side, leg in zip(("right", "left"), anatomy.legs, strict=True):
        names = [model.joint(joint).name if joint >= 0 else "" for joint in leg.joints]
        toe, heel = leg.sole[:2], leg.sole[2:]
        length = np.linalg.norm(toe.mean(axis=0) - heel.mean(axis=0))
        breadth = [float(np.linalg.norm(end[0] - end[1])) for end in (toe, heel)]
        straight = np.degrees(leg.zero) + 0.0
        inversion = f"; {names[INVERSION]} tilts the sole inward" if names[INVERSION] else ""
        out |= {
            f"{side} thigh": f"{model.body(leg.thigh).name}; {_joined([name for name in names[:HIP] if name])} it",
            f"{side} shank": f"{model.body(leg.shank).name}, {leg.length:.3g} m long; {names[KNEE]} turns it, and the "
                             f"leg is straight at {straight[KNEE]:.2f} degrees",
            f"{side} foot": f"{model.body(leg.foot).name}; {names[ANKLE]} turns it, and the sole is at a right angle "
                            f"to the shank at {straight[ANKLE]:.2f} degrees{inversion}",
            f"{side} sole": f"{length:.3g} m long" + ("" if planar else f", {breadth[0]:.3g} m wide at the toe, "
                            f"{breadth[1]:.3g} m at the heel"),
        }  # fmt: skip
    return out


def _joined(names: list[str]) -> str:
    """Names of joints and what they do."""
    return f"{', '.join(names)} turn{'s' if len(names) == 1 else ''}"


def _planar(path: Path, general: bool) -> str:
    """Why a model is no planar biped of seven links; empty if it is one."""
    if general or path.suffix != ".xml":
        return "it is described as another"
    from biped.robot.planar.model import tree_at

    try:
        description_of(path)
        tree_at(path)
    except InputError as error:
        return str(error)
    return ""
