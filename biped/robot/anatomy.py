"""Torso, thighs, shanks, feet and soles of a biped, and how its joints turn them: by geometry alone.

Legs hang on the bodies that both share: three hinges of the hip in any order and tilt, a knee across, and one or two
hinges of the ankle; in the plane one hinge of each. Angles count from geometry: a knee is straight where hip, knee and
ankle are in line, an ankle is at zero where the sole is square to the shank.
"""

import math
from typing import Any, NamedTuple

import mujoco
import numpy as np

from biped.base.errors import InputError
from biped.robot.parts import above
from biped.robot.robot import FootParts, Robot
from biped.robot.sole import EVEN, furthest, height_over_rest

HIP, JOINTS = 3, 6
KNEE, ANKLE, INVERSION = range(HIP, JOINTS)
"""Places of the joints in a leg; its first three are the hip's, in the file's order."""
SIDE = (-1.0, 1.0)
"""Sign of y on the right and left."""
_ACROSS = 0.7
"""Share of an axis along y from which it turns a leg in the plane of walking."""
_IN_PLANE = 1.0 - 1e-6
"""The same of a robot that moves in the plane."""
_ALONG = 0.7
"""The same along x, of the axis that turns a sole inward."""
_SPANNED = 0.2
"""[1] volume that the hip's three axes span at least."""
_POINT = 1e-5
"""[m] radius of a sphere that is a point: its centre."""
_CORNERS = 3
"""That a sole has at least."""
_BENDS = 0.1
"""[rad] that a knee bends at least."""
_LIFT = 0.002
"""[m] above the ground up to which it may bear a sole, by margins of contacts: the law sees a contact by its height."""
_HINGE = mujoco.mjtJoint.mjJNT_HINGE
_CLOSING = tuple(getattr(mujoco.mjtEq, f"mjEQ_{kind}") for kind in ("CONNECT", "WELD", "JOINT", "TENDON"))
"""Kinds of constraints that the law does not know."""


class JointedLeg(NamedTuple):
    """A leg: what turns it, and which way.

    Attributes:
        joints: (6,) numbers of its joints: three of the hip, knee, ankle, inversion; -1 where there is none, as in the
            plane of the second and third of the hip.
        sign: (6,) +1.0 where knee and ankle turn as flexion does (about -y) and the sole inward, else -1.0.
        zero: (6,) [rad] coordinate at which a joint's angle is zero.
        thigh: Number of the body.
        shank: Number of the body.
        foot: Number of the body.
        axes: (3, 3) the thigh's own axes as columns, in its body's frame: forward, along the knee's, up to the hip.
        sole: (4, 3) [m] inner and outer toe, inner and outer heel, in the foot's frame.
        knee: (3,) [m] place of the knee with all coordinates at zero.
        length: [m] of the shank.
        height: [m] of the whole leg, thigh, shank and ankle above the sole, as if it stood straight.
    """

    joints: tuple[int, ...]
    sign: np.ndarray
    zero: np.ndarray
    thigh: int
    shank: int
    foot: int
    axes: np.ndarray
    sole: np.ndarray
    knee: np.ndarray
    length: float
    height: float

    @property
    def hips(self) -> list[int]:
        """Numbers of the hip's joints."""
        return [joint for joint in self.joints[:HIP] if joint >= 0]


class Anatomy(NamedTuple):
    """A biped in space or in the plane.

    Attributes:
        torso: Number of its base's body.
        axes: (3, 3) the torso's own axes as columns, in its body's frame: forward, left, up.
        trunk: Numbers of all joints that are neither the base's nor a leg's, the last of the file first.
        shared: How many of the last of these both legs hang on.
        legs: The right one, the left one.
    """

    torso: int
    axes: np.ndarray
    trunk: tuple[int, ...]
    shared: int
    legs: tuple[JointedLeg, JointedLeg]

    @property
    def leg(self) -> float:
        """[m] from hip to sole of a leg that stands straight."""
        return 0.5 * (self.legs[0].height + self.legs[1].height)


def anatomy_of(model: mujoco.MjModel, robot: Robot) -> Anatomy:
    """The anatomy of a biped.

    Args:
        model: Of the robot.
        robot: What is recognised of it.

    Raises:
        InputError: It is no biped of this kind; names the joint, the body or the foot that is another.
    """
    key = robot, *(part.tobytes() for part in _geometry(model))
    if key not in _known:
        if len(_known) >= _MOST_KNOWN:
            _known.clear()
        _known[key] = _anatomy_of(model, robot)
    return _known[key]


_known: dict[tuple[Any, ...], Anatomy] = {}
"""The latest: a run asks for its robot's five times, and a search has thousands of runs."""
_MOST_KNOWN = 8


def _geometry(model: mujoco.MjModel) -> tuple[np.ndarray, ...]:
    """All of a model that an anatomy follows from, beside the robot."""
    return (model.qpos0, model.body_parentid, model.body_pos, model.body_quat, model.jnt_type, model.jnt_bodyid,
            model.jnt_pos, model.jnt_axis, model.geom_type, model.geom_pos, model.geom_size, model.eq_type,
            model.eq_active0, model.jnt_limited, model.jnt_range, model.geom_margin)  # fmt: skip


def _anatomy_of(model: mujoco.MjModel, robot: Robot) -> Anatomy:
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    base = robot.base_number
    chains = [_between(model, base, foot) for foot in robot.feet]
    common = [joint for joint in chains[0] if joint in chains[1]]
    if not robot.planar and data.xpos[robot.feet[0].bodies[0], 1] >= data.xpos[robot.feet[1].bodies[0], 1]:
        raise _fault(robot, f"foot '{robot.feet[0].name}' is to the left of foot '{robot.feet[1].name}'; expected the "
                            "right foot first")  # fmt: skip
    legs = [_leg(model, data, robot, side, [joint for joint in chain if joint not in common])
            for side, chain in enumerate(chains)]  # fmt: skip
    ours = {joint for leg in legs for joint in leg.joints}
    own = [int(joint) for joint in model.dof_jntid[list(robot.base_columns)]]
    if robot.planar and own[2] != max(own):
        raise _fault(robot, f"joint '{model.joint(max(own)).name}' of the base turns with joint "
                            f"'{model.joint(own[2]).name}'; expected slides first")  # fmt: skip
    trunk = [j for j in reversed(range(model.njnt)) if j not in ours and j not in own and j not in common]
    for joint in trunk + common:
        if mujoco.mjtJoint(model.jnt_type[joint]) not in (_HINGE, mujoco.mjtJoint.mjJNT_SLIDE):
            raise _fault(robot, f"joint '{model.joint(joint).name}' is a ball; expected hinges")
        if beside := _beside(model, joint, legs):
            raise _fault(robot, f"joint '{model.joint(joint).name}' hangs on the {beside} leg beside its own; expected "
                                "hinges from hip to foot alone")  # fmt: skip
    driven = {drive.joint for drive in robot.drives}
    for joint in range(model.njnt):
        if joint not in own and model.joint(joint).name not in driven:
            raise _fault(robot, f"joint '{model.joint(joint).name}' has no actuator; expected one on every joint")
    turn = data.xmat[base].reshape(3, 3)
    return Anatomy(base, turn.T.copy(), (*trunk, *reversed(common)), len(common), (legs[0], legs[1]))


def _beside(model: mujoco.MjModel, joint: int, legs: list[JointedLeg]) -> str:
    """Which leg a joint hangs on; empty if it hangs on none."""
    chain = above(model, int(model.jnt_bodyid[joint]))
    hips = [int(model.jnt_bodyid[leg.joints[0]]) for leg in legs]
    return "right" if hips[0] in chain else "left" if hips[1] in chain else ""


def _fault(robot: Robot, what: str) -> InputError:
    return InputError(f"law: 'thesis' is not for model '{robot.name}': {what}", "law")


def _between(model: mujoco.MjModel, base: int, foot: FootParts) -> list[int]:
    """Joints from the base to a foot, outward."""
    chain = [body for body in reversed(above(model, foot.bodies[0])) if body != base]
    return [j for body in chain
            for j in range(model.body_jntadr[body], model.body_jntadr[body] + model.body_jntnum[body])]  # fmt: skip


def _leg(model: mujoco.MjModel, data: mujoco.MjData, robot: Robot, side: int, joints: list[int]) -> JointedLeg:
    foot = robot.feet[side]
    names = ", ".join(f"'{model.joint(joint).name}'" for joint in joints) or "none"
    for joint in joints:
        if mujoco.mjtJoint(model.jnt_type[joint]) != _HINGE:
            raise _fault(robot, f"joint '{model.joint(joint).name}' of foot '{foot.name}' is no hinge")
    if robot.planar:
        wanted, words = (3,), "one of the hip, a knee and an ankle: it moves in the plane"
    else:
        wanted, words = (JOINTS - 1, JOINTS), "three of the hip, a knee, and one or two of the ankle"
    if len(joints) not in wanted:
        raise _fault(robot, f"foot '{foot.name}' hangs on {len(joints)} joints ({names}); expected {words}")
    closing = np.flatnonzero(np.isin(model.eq_type, _CLOSING) & (model.eq_active0 != 0))
    if len(closing):
        name = model.equality(int(closing[0])).name
        which = f"'{name}'" if name else f"number {closing[0] + 1}"
        raise _fault(robot, f"<equality> {which} closes a linkage; expected a tree of joints")
    hips = joints[: 1 if robot.planar else HIP]
    knee, ankle, *more = joints[len(hips) :]
    inversion = more[0] if more else -1
    if robot.planar:
        _across(model, robot, hips[0], data.xaxis[hips[0]], "a hip")
    elif abs(np.linalg.det(data.xaxis[hips])) < _SPANNED:
        hip = ", ".join(f"'{model.joint(joint).name}'" for joint in hips)
        raise _fault(robot, f"the hip's joints {hip} do not turn the thigh every way")
    _across(model, robot, knee, data.xaxis[knee], "a knee")
    if more:
        if abs(data.xaxis[ankle, 1]) < abs(data.xaxis[inversion, 1]):
            ankle, inversion = inversion, ankle
        if abs(data.xaxis[inversion, 0]) < _ALONG:
            raise _fault(robot, f"joint '{model.joint(inversion).name}' does not turn the sole inward")
    _across(model, robot, ankle, data.xaxis[ankle], "an ankle")
    body = int(model.jnt_bodyid[joints[-1]])
    wrong = [one for one in foot.bodies if model.body_weldid[one] != model.body_weldid[body]]
    if wrong:
        raise _fault(robot, f"body '{model.body(wrong[0]).name}' of foot '{foot.name}' moves against '"
                            f"{model.body(body).name}'; expected a stiff sole")  # fmt: skip
    for geom in foot.geoms:  # margins of two geoms add up, and a gap takes nothing off
        if (lift := float(model.geom_margin[geom] + model.geom_margin[robot.ground])) > _LIFT:
            name = model.geom(geom).name or geom
            raise _fault(robot, f"geom '{name}' of foot '{foot.name}' has a margin by which the ground bears it from "
                                f"{lift:g} m above on; expected at most {_LIFT:g} m")  # fmt: skip
    pitch = max(hips, key=lambda joint: abs(data.xaxis[joint, 1]))
    lateral = data.xaxis[knee] * math.copysign(1.0, data.xaxis[knee, 1])
    high, middle, low = (data.xanchor[joint] for joint in (pitch, knee, ankle))
    links = ("thigh", pitch, knee, high - middle), ("shank", knee, ankle, middle - low)
    for part, upper, lower, way in links:
        if np.linalg.norm(np.cross(way, lateral)) < _POINT:
            raise _fault(robot, f"joint '{model.joint(lower).name}' has the axis of joint '{model.joint(upper).name}'; "
                                f"expected a {part} between them")  # fmt: skip
    thigh, shank = _square(high - middle, lateral), _square(middle - low, lateral)
    sole = _sole(model, data, robot, side)
    turn = data.xmat[foot.on[0]].reshape(3, 3)
    up = _normal(sole @ turn.T, side, robot.planar)
    corners = (data.xpos[foot.on[0]] + sole @ turn.T) @ up
    deeper = float(corners.min()) + max(furthest(model, data, geom, -up) for geom in foot.geoms)
    if deeper > _POINT:  # what is round touches elsewhere when the foot is flat
        sole = sole - deeper * up @ turn
    order = (*hips, *[-1] * (HIP - len(hips)), knee, ankle, inversion)
    sign, zero = np.ones(JOINTS), np.zeros(JOINTS)
    bent = _angle(shank, lateral) - _angle(thigh, lateral)
    across = data.xaxis[ankle] * math.copysign(1.0, data.xaxis[ankle, 1])
    tilted = _angle(up, across) - _angle(shank, across)
    inward = -SIDE[side] * (math.atan2(-up[1], up[2]) - math.atan2(-shank[1], shank[2]))
    for place, angle, along in ((KNEE, bent, -data.xaxis[knee, 1]), (ANKLE, tilted, -data.xaxis[ankle, 1]),
                                (INVERSION, inward, -SIDE[side] * data.xaxis[inversion, 0])):  # fmt: skip
        joint = order[place]
        if joint >= 0:
            sign[place] = math.copysign(1.0, along)
            zero[place] = data.qpos[model.jnt_qposadr[joint]] - sign[place] * angle
    _bends_back(model, robot, knee, sign[KNEE], zero[KNEE])
    body = int(model.jnt_bodyid[hips[-1]])
    own = data.xmat[body].reshape(3, 3)
    length = float(np.linalg.norm(_offset(model, knee, ankle)))
    above_sole = float((low - data.xpos[foot.on[0]] - (sole @ turn.T).mean(axis=0)) @ up)
    if above_sole <= 0.0:
        raise _fault(robot, f"foot '{foot.name}' has its sole above joint '{model.joint(ankle).name}'; expected it "
                            "below")  # fmt: skip
    straight = float(np.linalg.norm(np.cross(high - middle, lateral)))
    return JointedLeg(
        joints=order, sign=sign, zero=zero, thigh=body, shank=int(model.jnt_bodyid[knee]), foot=foot.on[0],
        axes=own.T @ np.column_stack([np.cross(lateral, thigh), lateral, thigh]), sole=sole, knee=middle.copy(),
        length=length, height=straight + length + above_sole,
    )  # fmt: skip


def _bends_back(model: mujoco.MjModel, robot: Robot, knee: int, sign: float, zero: float) -> None:
    """Makes sure that a knee has more room to flex than to stretch, as that of a robot has that faces x."""
    if model.jnt_limited[knee]:
        back, ahead = sorted(sign * (model.jnt_range[knee] - zero))  # flexion is negative
        if ahead - back < _BENDS:
            raise _fault(robot, f"joint '{model.joint(knee).name}' bends the shank by {math.degrees(ahead - back):.2g} "
                                "degrees; expected a knee that bends")  # fmt: skip
        if ahead > -back:
            raise _fault(
                robot,
                f"joint '{model.joint(knee).name}' brings the shank {math.degrees(ahead):.0f} degrees forward "
                f"and {0.0 - math.degrees(back):.0f} back; expected a knee of a robot that faces along x",
            )


def _across(model: mujoco.MjModel, robot: Robot, joint: int, axis: np.ndarray, what: str) -> None:
    if abs(axis[1]) < (_IN_PLANE if robot.planar else _ACROSS):
        raise _fault(robot, f"joint '{model.joint(joint).name}' turns about {np.round(axis, 2).tolist()} where {what} "
                            "turns about the lateral axis, y")  # fmt: skip


def _square(way: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """(3,) the direction of a way, square to an axis."""
    out = way - (way @ axis) * axis
    return out / np.linalg.norm(out)


def _angle(way: np.ndarray, lateral: np.ndarray) -> float:
    """[rad] of a direction in the plane square to a lateral axis, as rotation about -y counts."""
    up = _square(np.array([0.0, 0.0, 1.0]), lateral)
    return math.atan2(way @ up, way @ np.cross(lateral, up))


def _offset(model: mujoco.MjModel, knee: int, ankle: int) -> np.ndarray:
    """(3,) [m] from the knee to the ankle, in the shank's frame."""
    out, body, turned = model.jnt_pos[ankle].copy(), int(model.jnt_bodyid[ankle]), np.empty(3)
    while body != model.jnt_bodyid[knee]:
        mujoco.mju_rotVecQuat(turned, out, model.body_quat[body])
        out = model.body_pos[body] + turned
        body = int(model.body_parentid[body])
    return out - model.jnt_pos[knee]


def _sole(model: mujoco.MjModel, data: mujoco.MjData, robot: Robot, side: int) -> np.ndarray:
    """(4, 3) [m] inner and outer toe, inner and outer heel, in the foot's frame; in the plane each end twice."""
    foot = robot.feet[side]
    geoms = list(foot.geoms)
    tiny = (model.geom_type[geoms] == mujoco.mjtGeom.mjGEOM_SPHERE) & (model.geom_size[geoms, 0] <= _POINT)
    own = len(set(foot.on)) == 1
    places = model.geom_pos[geoms] if own and tiny.all() else np.array(foot.points)
    turn, origin = data.xmat[foot.on[0]].reshape(3, 3), data.xpos[foot.on[0]]
    if not own:
        places = np.array([turn.T @ (data.xpos[on] + data.xmat[on].reshape(3, 3) @ place - origin)
                           for on, place in zip(foot.on, foot.points, strict=True)])  # fmt: skip
    there = places @ turn.T
    even = height_over_rest(there) < EVEN  # a toe or an edge that is higher is not what the foot stands on
    places, flat = places[even], there[even, :2]
    extent = np.ptp(flat, axis=0)
    if robot.planar:
        if extent[0] < 2.0 * _POINT:
            raise _fault(robot, f"foot '{foot.name}' touches the ground at a point; expected a toe and a heel")
        return places[np.repeat([np.argmax(flat[:, 0]), np.argmin(flat[:, 0])], 2)]
    if extent.min() < 2.0 * _POINT:
        raise _fault(robot, f"foot '{foot.name}' touches the ground along a line or at a point; expected a sole with "
                            "four corners")  # fmt: skip
    inward = -SIDE[side]
    flat = (flat - flat.mean(axis=0)) / extent
    corners = [int(np.argmax(flat @ [x, y * inward])) for x in (1.0, -1.0) for y in (1.0, -1.0)]
    if len(set(corners)) < _CORNERS:
        raise _fault(robot, f"foot '{foot.name}' has {len(set(corners))} corners; expected a sole with four, or "
                            "with one toe or one heel")  # fmt: skip
    return places[corners]


def _normal(sole: np.ndarray, side: int, planar: bool) -> np.ndarray:
    """(3,) upward normal of a sole whose corners are given in the world's axes."""
    forward = sole[:2].mean(axis=0) - sole[2:].mean(axis=0)
    left = -SIDE[side] * (sole[[0, 2]].mean(axis=0) - sole[[1, 3]].mean(axis=0))
    out = np.cross(forward, [0.0, 1.0, 0.0] if planar else left)
    return out / np.linalg.norm(out)
