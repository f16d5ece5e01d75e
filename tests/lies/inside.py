"""Lies that are written down one by one, most of them inside a robot, where no momentum shows them: parts and laws."""

from __future__ import annotations

from collections.abc import Callable
from xml.etree import ElementTree

from tests.lies.helped import MODELS

XML = ElementTree.Element


def _all(tag: str, **attributes: str) -> Callable[[XML], None]:
    """Every element of a kind gets attributes."""

    def change(root: XML) -> None:
        for one in root.iter(tag):
            one.attrib |= attributes

    return change


def _option(flag: dict[str, str] | None = None, **attributes: str) -> Callable[[XML], None]:
    def change(root: XML) -> None:
        option = ElementTree.SubElement(root, "option", attributes)
        if flag is not None:
            ElementTree.SubElement(option, "flag", flag)

    return change


def _own(root: XML) -> list[XML]:
    """The robot's own joints."""
    world = root.find("worldbody")
    assert world is not None
    base = [joint for body in world.findall("body") for joint in body]
    return [joint for joint in world.iter("joint") if joint not in base]


def _joints(**attributes: str) -> Callable[[XML], None]:
    def change(root: XML) -> None:
        for joint in _own(root):
            joint.attrib |= attributes

    return change


def _actuators(kind: str, **attributes: str) -> Callable[[XML], None]:
    """One actuator more at every joint of the robot."""

    def change(root: XML) -> None:
        section = root.find("actuator")
        assert section is not None
        for number, joint in enumerate(_own(root)):
            more = {"name": f"lie{number}", "joint": str(joint.get("name"))}
            ElementTree.SubElement(section, kind, more | attributes)

    return change


def _world(**attributes: str) -> Callable[[XML], None]:
    """A geom more of the world, which everything meets."""

    def change(root: XML) -> None:
        world = root.find("worldbody")
        assert world is not None
        ElementTree.SubElement(world, "geom", {"contype": "255", "conaffinity": "255"} | attributes)

    return change


def _ground(**attributes: str) -> Callable[[XML], None]:
    def change(root: XML) -> None:
        world = root.find("worldbody")
        assert world is not None
        for geom in world.findall("geom"):
            geom.attrib |= attributes

    return change


def _trunk(tag: str, more: dict[str, str], **attributes: str) -> Callable[[XML], None]:
    """A part more of the trunk: a body at a place with an inertia, or a geom."""

    def change(root: XML) -> None:
        world = root.find("worldbody")
        assert world is not None
        trunk = world.find("body")
        assert trunk is not None
        part = ElementTree.SubElement(trunk, tag, attributes)
        if more:
            ElementTree.SubElement(part, "geom", more)

    return change


def _muscle(root: XML) -> None:
    """A muscle between the trunk and a hook in the sky."""
    world, actuators = root.find("worldbody"), root.find("actuator")
    assert world is not None
    assert actuators is not None
    ElementTree.SubElement(world, "site", {"name": "hook", "pos": "0 0 3"})
    trunk = world.find("body")
    assert trunk is not None
    ElementTree.SubElement(trunk, "site", {"name": "tied"})
    spatial = ElementTree.SubElement(ElementTree.SubElement(root, "tendon"), "spatial", {"name": "lie"})
    for site in ("hook", "tied"):
        ElementTree.SubElement(spatial, "site", {"site": site})
    ElementTree.SubElement(actuators, "muscle", {"name": "lie", "tendon": "lie", "force": "500"})


def _belt(root: XML) -> None:
    """Ground that is a body that slides."""
    world = root.find("worldbody")
    assert world is not None
    belt = ElementTree.SubElement(world, "body", {"name": "belt"})
    ElementTree.SubElement(belt, "joint", {"name": "belt", "type": "slide", "axis": "1 0 0"})
    ElementTree.SubElement(belt, "inertial", {"pos": "0 0 0", "mass": "1000", "diaginertia": "1 1 1"})
    for geom in world.findall("geom"):
        world.remove(geom)
        belt.append(geom)
        geom.attrib |= {"type": "box", "size": "20 20 0.1", "pos": "0 0 -0.1"}


SPRINGS = {"stiffness": "3000"}
PARTS: dict[str, Callable[[XML], None]] = {
    "friction that overrides": _option({"override": "enable"}, o_friction="9 9 1 1 1"),
    "margin that overrides": _option({"override": "enable"}, o_margin="0.2"),
    "softness that overrides": _option({"override": "enable"}, o_solref="0.3 1"),
    "gravity that is tilted": _option(gravity="2 0 -5"),
    "geoms that hover": _all("geom", margin="0.15"),
    "dampers that drive": _joints(damping="-3"),
    "springs that drive": _joints(stiffness="-300"),
    "more servos": _actuators("position", kp="2000", kv="50"),
    "more dampers": _actuators("damper", kv="2000", ctrlrange="0 1"),
    "servos that drive": _actuators("velocity", kv="-5"),
    "servos with a memory": _actuators("general", dyntype="integrator", gainprm="100", biastype="affine",
                                       biasprm="0 -100 -5"),
    "a muscle in the sky": _muscle,
    "an airbag": _trunk("flexcomp", {}, name="bag", type="grid", count="3 3 3", spacing=".1 .1 .1", dim="3", mass="1",
                        radius="0.02"),
    "ground that leans": _ground(euler="0 0.15 0"),
    "ground that is higher": _ground(pos="0 0 0.05"),
    "ground that is lower": _ground(pos="0 0 -0.3"),
    "a second ground": _world(type="plane", size="5 5 .1", pos="0 0 0.04"),
    "ground that slides": _belt,
    "a keel below the ground": _trunk("body", {"size": ".1", "mass": "500", "contype": "0", "conaffinity": "0"},
                                      name="keel", pos="0 0 -4"),
    "a box below the trunk": _world(type="box", size=".3 .5 .3", pos="0 0 .55"),
    "crutches": _trunk("geom", {}, type="capsule", size=".03", fromto="0 0 0 1 0 -1.25", mass="1", contype="255",
                       conaffinity="255"),
}  # fmt: skip
"""What is done to a model file, by what it is."""

_OWN = "own = [i for i in range(model.nv) if i not in columns]"
_BENT = "data.qpos[-len(own):] - first[-len(own):]"
LAWS = {
    "torques beyond the motors'": f"{_OWN}; data.qfrc_applied[own] = -2000 * ({_BENT})",
    "joints that are held": f"{_OWN}; data.qvel[own] = 0; data.qpos[-len(own):] = first[-len(own):]",
    "gears": "model.actuator_gear[:] = 5.0",
    "ranges of actuators": "model.actuator_ctrlrange[:] = [-1e5, 1e5]",
    "friction": "model.geom_friction[:, 0] = model.pair_friction[:] = 9.0",
    "soft ground": "model.geom_solref[:] = [0.3, 1]; model.pair_solref[:] = [0.3, 1]",
    "ground that leans": "model.geom_quat[0] = [0.995, 0, 0.0998, 0]",
    "ground that rises": "model.geom_pos[0, 2] = 0.2 * sensed.time",
    "dampers": f"{_OWN}; model.dof_damping[own] = 100",
    "springs": "model.jnt_stiffness[-6:] = 3000; model.qpos_spring[-6:] = first[-6:]",
    "rotors": f"{_OWN}; model.dof_armature[own] = 100",
    "stops": "model.jnt_limited[-6:] = 1; model.jnt_range[-6:] = [-0.01, 0.01]",
    "larger feet": "model.geom_size[1:] *= 1.02",
    "inertia": "model.body_inertia[1:] = 9.0",
    "time that stands still": "model.opt.timestep = 1e-9",
    "slow motion": "model.opt.timestep = 4e-4",
    "no solver": "model.opt.iterations = 0",
    "an option of the file": "model.opt.enableflags |= 1; model.opt.o_margin = 0.1",
    "a force": "data.xfrc_applied[self.robot.base_number, 2] = 0.5 * 9.81 * self.robot.mass",
    "time": "data.time += 1.0",
}
"""Lines of a law that stands, by what they change in the simulator."""


def model_with(part: str, model: str) -> str:
    """The text of a model file with one of the parts."""
    root = ElementTree.fromstring((MODELS / f"{model}.xml").read_text(encoding="utf-8"))
    PARTS[part](root)
    return ElementTree.tostring(root, encoding="unicode")


def law_with(line: str) -> str:
    """The text of a law that stands and has one of the lines."""
    return f"""import numpy as np
from biped.control.stand import stand


class Law:
    def __init__(self, setup):
        self.own, self.robot, self.first = stand(setup), setup.robot, None

    def torques(self, sensed):
        data, model, columns = sensed._data, sensed._model, list(self.robot.base_columns)
        first = self.first = data.qpos.copy() if self.first is None else self.first
        {LAWS[line]}
        return self.own.torques(sensed)
"""
