"""Actuators of a model file: which joint, which kind, what torque at most."""

import mujoco

from biped.base.files import nearest
from biped.base.typed import LARGEST
from biped.robot.robot import Drive
from biped.scenario.robot import Described

_EVEN = 1e-6
"""Share of a range by which its ends may differ."""

MOST_GEAR = 1e6
"""Of an actuator; a motor with a gearbox of 100 has 100."""


def drives_of(model: mujoco.MjModel, table: Described, faults: list[str]) -> tuple[Drive, ...]:
    """The actuators that a law commands.

    Args:
        model: The compiled model.
        table: What is said of the robot.
        faults: What is wrong is added here.
    """
    there = [model.actuator(i).name for i in range(model.nu)]
    wanted = list(table.actuators.names) or there
    if not wanted:
        faults.append("actuators: none; write <actuator><motor joint=…/></actuator> for each joint that is driven")
    found = []
    for name in wanted:
        if name not in there:
            faults.append(f"actuators.names: '{name}' is no actuator of the file; {nearest(name, there)}")
            continue
        drive = _drive(model, there.index(name), table, faults)
        if drive is not None:
            found.append(drive)
    driven = [drive.joint for drive in found]
    for joint in sorted({joint for joint in driven if driven.count(joint) > 1}):
        faults.append(f"actuators: joint '{joint}' has several; write [robot.actuators] names = […] with one for each")
    return tuple(found)


def _drive(model: mujoco.MjModel, i: int, table: Described, faults: list[str]) -> Drive | None:
    name, gear = model.actuator(i).name, float(model.actuator_gear[i, 0])
    if mujoco.mjtTrn(model.actuator_trntype[i]) not in (mujoco.mjtTrn.mjTRN_JOINT, mujoco.mjtTrn.mjTRN_JOINTINPARENT):
        faults.append(f"actuator '{name}': expected one on a joint (joint=…), not on a tendon, a site or a body")
        return None
    joint = int(model.actuator_trnid[i, 0])
    if mujoco.mjtJoint(model.jnt_type[joint]) not in (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE):
        faults.append(f"actuator '{name}': joint '{model.joint(joint).name}': expected a hinge or a slide")
        return None
    if model.actuator_dyntype[i] != mujoco.mjtDyn.mjDYN_NONE:
        faults.append(f"actuator '{name}': has a state of its own (muscle, filter, integrator); expected none: write "
                      "<motor>, <position> or <velocity>, and a lag as actuation.lag")  # fmt: skip
        return None
    kind = _kind(model, i)
    if kind is None:
        faults.append(f"actuator '{name}': neither torque, position nor velocity; write <motor>, <position> or "
                      "<velocity>")  # fmt: skip
        return None
    if model.actuator_history[i, 0] > 0:
        faults.append(f"actuator '{name}': has a delay of its own; expected none: write a lag as actuation.lag")
        return None
    if abs(gear) > MOST_GEAR:
        faults.append(f"actuator '{name}': gear {gear:g}: expected at most {MOST_GEAR:g}")
        return None
    if gear == 0.0:
        faults.append(f"actuator '{name}': gear 0 moves nothing; expected another")
        return None
    servo = gear * gear * float(model.actuator_gainprm[i, 0]) if kind != "torque" else 0.0
    damping = -(gear * gear) * float(model.actuator_biasprm[i, 2])
    low, high = sorted((model.actuator_ctrlrange[i] / gear).tolist())
    return Drive(
        name=name,
        joint=model.joint(joint).name,
        kind=kind,
        limit=_limit(model, i, joint, kind, gear, faults),
        place=int(model.jnt_qposadr[joint]),
        column=int(model.jnt_dofadr[joint]),
        turns=_turns(model, joint),
        stiffness=servo if kind == "position" else table.actuators.stiffness,
        damping=damping if kind != "torque" else table.actuators.damping,
        span=(low, high) if kind == "position" and model.actuator_ctrllimited[i] else None,
    )


def _turns(model: mujoco.MjModel, joint: int) -> int:
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    along = float(data.xaxis[joint, 1])
    return 0 if abs(along) < 0.7 or model.jnt_type[joint] != mujoco.mjtJoint.mjJNT_HINGE else (1 if along < 0 else -1)


def _kind(model: mujoco.MjModel, i: int) -> str | None:
    gain, bias = model.actuator_gainprm[i], model.actuator_biasprm[i]
    if model.actuator_gaintype[i] != mujoco.mjtGain.mjGAIN_FIXED or gain[0] == 0.0:
        return None
    if model.actuator_biastype[i] == mujoco.mjtBias.mjBIAS_NONE:
        return "torque"
    if model.actuator_biastype[i] != mujoco.mjtBias.mjBIAS_AFFINE or bias[0] != 0.0:
        return None
    if bias[1] == -gain[0]:
        return "position"
    return "velocity" if bias[1] == 0.0 and bias[2] == -gain[0] else None


def _limit(model: mujoco.MjModel, i: int, joint: int, kind: str, gear: float, faults: list[str]) -> float:
    """[N m] at the joint: the least of what actuator, joint and, of a motor, the control's range say."""
    limits, gain = [LARGEST], abs(gear * float(model.actuator_gainprm[i, 0]))
    for what, limited, span, factor in (
        ("forcerange", model.actuator_forcelimited[i], model.actuator_forcerange[i], abs(gear)),
        ("actuatorfrcrange of its joint", model.jnt_actfrclimited[joint], model.jnt_actfrcrange[joint], 1.0),
        ("ctrlrange", kind == "torque" and model.actuator_ctrllimited[i], model.actuator_ctrlrange[i], gain),
    ):
        if limited:
            low, high = (float(end) for end in span)
            if abs(low + high) > _EVEN * (high - low):
                faults.append(f"actuator '{model.actuator(i).name}': {what} {low:g} {high:g}: expected as much one way "
                              "as the other: a law's torques have one limit")  # fmt: skip
            limits.append(factor * max(-low, high))
    return min(limits)
