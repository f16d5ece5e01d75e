"""Robots that something helps: a random part of a model file, or a random force in a law, anywhere in the tree."""

from __future__ import annotations

import random
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

XML = ElementTree.Element
MODELS = Path(__file__).parents[2] / "models"
TORSO = 1
"""Number of the base's body."""


def _size(r: random.Random, low: float, high: float) -> float:
    return float(f"{low * (high / low) ** r.random():.4g}")


def _numbers(*values: float) -> str:
    return " ".join(f"{value:.6g}" for value in values)


def _somewhere(r: random.Random, root: XML) -> XML:
    """A body of the robot."""
    return r.choice([body for body in root.iter("body") if body.get("name")])


def _on_base(root: XML) -> list[XML]:
    """The joints that carry the base."""
    world = root.find("worldbody")
    assert world is not None
    return [joint for body in world.findall("body") for joint in body if joint.tag in ("joint", "freejoint")]


def _section(root: XML, name: str) -> XML:
    found = root.find(name)
    return ElementTree.SubElement(root, name) if found is None else found


def _of_joint(r: random.Random, root: XML) -> str:
    joint = r.choice(_on_base(root))
    if joint.tag == "freejoint" or joint.get("type") == "free":  # of which all that follows is left out
        return _fastened(r, root)
    what = r.choice(("damping", "armature", "frictionloss", "stiffness", "range"))
    if what == "range":
        joint.attrib |= {"limited": "true", "range": _numbers(-_size(r, 1e-3, 0.1), _size(r, 1e-3, 0.1))}
    else:
        joint.set(what, _numbers(_size(r, 50.0, 1e4)))
    return f"{what} on {joint.get('name')}"


def _motor(r: random.Random, root: XML) -> str:
    joints = [joint for joint in _on_base(root) if joint.get("type") != "free" and joint.tag == "joint"]
    if not joints:
        return _thruster(r, root)
    joint = r.choice(joints)
    ElementTree.SubElement(_section(root, "actuator"), r.choice(("motor", "position", "velocity")),
                           {"name": "lie", "joint": str(joint.get("name"))})  # fmt: skip
    return f"motor on {joint.get('name')}"


def _thruster(r: random.Random, root: XML) -> str:
    body = _somewhere(r, root)
    ElementTree.SubElement(body, "site", {"name": "lie"})
    gear = _numbers(*(r.uniform(-1, 1) for _ in range(6)))
    ElementTree.SubElement(_section(root, "actuator"), "motor", {"name": "lie", "site": "lie", "gear": gear})
    return f"thruster on {body.get('name')}"


def _fastened(r: random.Random, root: XML) -> str:
    body, kind = _somewhere(r, root), r.choice(("weld", "connect"))
    more = {"anchor": _numbers(*(r.uniform(-0.2, 0.2) for _ in range(3)))} if kind == "connect" else {}
    soft = _numbers(_size(r, 0.005, 0.3), 1.0)
    ElementTree.SubElement(_section(root, "equality"), kind, {"body1": str(body.get("name")), "solref": soft, **more})
    return f"{kind} of {body.get('name')}"


def _rail(r: random.Random, root: XML) -> str:
    joints = [joint for joint in _on_base(root) if joint.tag == "joint" and joint.get("type") != "free"]
    if not joints:
        return _fastened(r, root)
    joint = r.choice(joints)
    ElementTree.SubElement(_section(root, "equality"), "joint", {"joint1": str(joint.get("name"))})
    return f"equality on {joint.get('name')}"


def _rope(r: random.Random, root: XML) -> str:
    joints = [joint for joint in _on_base(root) if joint.tag == "joint" and joint.get("type") != "free"]
    tendon, what = _section(root, "tendon"), r.choice(("stiffness", "damping"))
    size = {what: _numbers(_size(r, 100.0, 1e4))}
    if joints and r.random() < 0.5:
        joint = r.choice(joints)
        fixed = ElementTree.SubElement(tendon, "fixed", size)
        ElementTree.SubElement(fixed, "joint", {"joint": str(joint.get("name")), "coef": "1"})
        return f"tendon with {what} over {joint.get('name')}"
    body, world = _somewhere(r, root), root.find("worldbody")
    assert world is not None
    ElementTree.SubElement(world, "site", {"name": "hook", "pos": _numbers(r.uniform(-1, 1), 0.0, r.uniform(2, 4))})
    ElementTree.SubElement(body, "site", {"name": "tied"})
    spatial = ElementTree.SubElement(tendon, "spatial", size | {"springlength": "0.5"})
    for site in ("hook", "tied"):
        ElementTree.SubElement(spatial, "site", {"site": site})
    return f"rope with {what} on {body.get('name')}"


def _air(r: random.Random, root: XML) -> str:
    option = ElementTree.SubElement(root, "option")
    what = r.choice(("wind", "density", "viscosity"))
    option.set("density", _numbers(_size(r, 100.0, 3000.0)))
    if what == "viscosity":
        option.set("viscosity", _numbers(_size(r, 1.0, 100.0)))
    elif what == "wind":
        option.set("wind", _numbers(r.uniform(-8, 8), 0.0, r.uniform(-2, 8)))
    return what


def _weightless(r: random.Random, root: XML) -> str:
    if r.random() < 0.2:
        ElementTree.SubElement(ElementTree.SubElement(root, "option"), "flag", {"gravity": "disable"})
        return "no gravity"
    bodies = [body for body in root.iter("body") if body.get("name")]
    for body in r.sample(bodies, r.randint(1, len(bodies))):
        body.set("gravcomp", _numbers(_size(r, 0.3, 1.2)))
    return "gravcomp"


PARTS: tuple[Callable[[random.Random, XML], str], ...] = (
    _of_joint, _motor, _thruster, _fastened, _rail, _rope, _air, _weightless,
)  # fmt: skip


def helped_model(number: int, model: str) -> tuple[str, str]:
    """A model file with one part more that holds or drives the robot from outside, and what that is."""
    r = random.Random(f"part {number}")
    root = ElementTree.fromstring((MODELS / f"{model}.xml").read_text(encoding="utf-8"))
    what = r.choice(PARTS)(r, root)
    return ElementTree.tostring(root, encoding="unicode"), what


def helping_law(number: int) -> tuple[str, str]:
    """The text of a law that stands, and meanwhile has a random force act on its robot, and what that is.

    It gets hold of MuJoCo's state behind what it is given, as nothing in Python can forbid.
    """
    r = random.Random(f"law {number}")
    share, start = _size(r, 0.02, 1.0), r.uniform(0.0, 0.4)
    length, body = r.uniform(0.3, 1.0), r.random()
    way = [r.gauss(0.0, 1.0) for _ in range(3)]
    what = r.choice(("force", "moment", "place", "base", "velocity"))
    lines = {
        "force": "data.xfrc_applied[body, :3] = on * share * weight * way",
        "moment": "data.xfrc_applied[body, 3:] = on * share * weight * leg * way",
        "place": "data.qfrc_applied[:] = on * share * weight * leg * (robot[0] * 0 + turned)",
        "base": "data.qfrc_applied[columns] = on * share * weight * some",
        "velocity": "data.qvel[columns] += on * 0.01 * share * some",
    }
    text = f"""import numpy as np
from biped.control.stand import stand


class Law:
    def __init__(self, setup):
        self.own, self.robot = stand(setup), setup.robot
        self.way = np.array({way!r}) / np.linalg.norm({way!r})

    def torques(self, sensed):
        data, model, share, way = sensed._data, sensed._model, {share!r}, self.way
        on = float({start!r} <= sensed.time < {start + length!r})
        body = self.robot.base_number + int({body!r} * (model.nbody - self.robot.base_number))
        columns = list(self.robot.base_columns)
        weight, leg, robot = 9.81 * self.robot.mass, self.robot.leg, data.qvel[:1]
        some = np.resize(way, len(columns))
        turned = np.zeros(model.nv)
        turned[columns[-1]] = 1.0
        {lines[what]}
        return self.own.torques(sensed)
"""
    return text, f"{what} of {100.0 * share:.3g} % from {start:.2f} s for {length:.2f} s"
