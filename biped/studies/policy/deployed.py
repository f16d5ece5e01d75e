"""A card from a YAML file beside a network: Unitree's deploy.yaml, or Isaac Lab's IO descriptors."""

from pathlib import Path
from typing import Any

from biped.base.errors import InputError
from biped.base.files import label, nearest
from biped.robot.robot import Robot

TERMS = {
    "base_lin_vel": "linear_velocity", "base_ang_vel": "angular_velocity", "projected_gravity": "gravity",
    "joint_pos": "joint_position", "joint_pos_rel": "joint_position", "joint_vel": "joint_velocity",
    "joint_vel_rel": "joint_velocity", "actions": "last_action", "last_action": "last_action", "command": "command",
    "velocity_commands": "command", "generated_commands": "command", "twist": "command", "phase": "clock_sin_cos",
    "gait_phase": "clock_sin_cos",
}  # fmt: skip
"""Names that trainers give to terms."""


def term_of(term: str, name: str, scale: Any, length: Any) -> dict[str, Any]:
    """A term of a card's observation.

    Args:
        term: What the trainer calls it.
        name: Of the file that says so.
        scale: Its factors, if any.
        length: Of its history.

    Raises:
        InputError: No term of a card is called so.
    """
    if term not in TERMS:
        raise InputError(f"{name}: observation '{term}': no term of a card is called so; {nearest(term, list(TERMS))} "
                         "Write a card by hand (docs/your-policy.md)")  # fmt: skip
    out: dict[str, Any] = {"term": TERMS[term]}
    if isinstance(scale, list) and len(set(scale)) == 1:
        scale = scale[0]
    if scale not in (None, 1.0):
        out["scale"] = scale
    if isinstance(length, int | float) and length > 1:
        out["history"] = int(length)
    return out


def of_yaml(path: Path, robot: Robot) -> dict[str, Any]:
    """Returns a card, as plain data, from whichever of these a file is.

    Args:
        path: The file.
        robot: What the policy moves.

    Raises:
        InputError: Something in it is missing, by name, or cannot be understood.
    """
    data = _yaml(path)
    return (_of_descriptors if "articulations" in data else _of_deploy)(data, label(path), robot)


def _of_deploy(data: dict[str, Any], name: str, robot: Robot) -> dict[str, Any]:
    """A card from a deploy.yaml, whose gains are in the robot's order and whose positions in the network's."""
    order = data.get("joint_ids_map")
    drives = [drive.joint for drive in robot.drives]
    if not isinstance(order, list) or any(not isinstance(i, int) or not 0 <= i < len(drives) for i in order):
        raise InputError(f"{name}: joint_ids_map: expected numbers of the {len(drives)} driven joints of "
                         f"'{robot.name}', got {str(order)[:100]}")  # fmt: skip
    try:
        _, asked = next(iter(data["actions"].items()))
        observation = data["observations"]
        stiffness, damping = ([data[key][i] for i in order] for key in ("stiffness", "damping"))
        ranges = data.get("commands", {}).get("base_velocity", {}).get("ranges", {})
        card: dict[str, Any] = {
            "rate": round(1.0 / data["step_dt"], 9),
            "joints": [drives[i] for i in order],
            "default": data["default_joint_pos"],
            "action": {"scale": asked["scale"], "offset": asked["offset"], "stiffness": stiffness, "damping": damping},
            "observation": [term_of(term, name, about.get("scale"), about.get("history_length"))
                            for term, about in observation.items()],
            "command": {ours: ranges[theirs] for ours, theirs in (
                ("forward", "lin_vel_x"), ("left", "lin_vel_y"), ("yaw", "ang_vel_z")) if theirs in ranges},
            "source": {"deploy": name},
        }  # fmt: skip
        for term, about in observation.items():
            if TERMS.get(term, "").startswith("clock") and "period" in (about.get("params") or {}):
                card["clock"] = {"frequency": round(1.0 / about["params"]["period"], 9)}
    except (KeyError, IndexError, TypeError, AttributeError, StopIteration, ZeroDivisionError) as error:
        raise InputError(f"{name}: expected step_dt, stiffness, damping, default_joint_pos, actions and observations, "
                         f"as Unitree writes them; {type(error).__name__}: {error}") from None  # fmt: skip
    return card


def _of_descriptors(data: dict[str, Any], name: str, robot: Robot) -> dict[str, Any]:
    """A card from Isaac Lab's IO descriptors, whose lists are in the order of the joints that they name."""
    try:
        (asked,) = data["actions"]
        parts = next(iter(data["articulations"].values()))
        joints, known = asked["joint_names"], parts["joint_names"]
        per = {key: dict(zip(known, parts[f"default_joint_{key}"], strict=True)) for key in (
            "pos", "stiffness", "damping")}  # fmt: skip
        (terms,) = data["observations"].values() if len(data["observations"]) == 1 else [data["observations"]["policy"]]
        action: dict[str, Any] = {key: asked[key] for key in ("scale", "offset") if asked.get(key) is not None}
        kind = str(asked["full_path"]).rpartition(".")[2]
        if kind not in ("JointPositionAction", "JointEffortAction"):
            raise InputError(f"{name}: actions: expected JointPositionAction or JointEffortAction, got {kind}")
        if kind == "JointEffortAction":
            action["kind"] = "torque"
        elif any(per["stiffness"][joint] for joint in joints):
            action |= {key: [per[key][joint] for joint in joints] for key in ("stiffness", "damping")}
        observation = []
        for about in terms:
            more = about["overloads"]
            one = term_of(about["name"], name, more.get("scale"), more.get("history_length"))
            if more.get("clip") is not None:
                one["clip"] = more["clip"]
            if one["term"].startswith("joint") and about["joint_names"] != joints:
                one["joints"] = about["joint_names"]
            observation.append(one)
        return {
            "rate": round(1.0 / data["scene"]["dt"], 9), "joints": joints,
            "default": [per["pos"][joint] for joint in joints], "action": action, "observation": observation,
            "source": {"descriptors": name},
        }  # fmt: skip
    except (KeyError, TypeError, AttributeError, ValueError, StopIteration, ZeroDivisionError) as error:
        raise InputError(f"{name}: expected one action, articulations, observations and scene, as Isaac Lab's IO "
                         f"descriptors have them; {type(error).__name__}: {error}") from None  # fmt: skip


def _yaml(path: Path) -> dict[str, Any]:
    try:
        import yaml
    except ImportError:
        raise InputError(
            f"{label(path)}: reading YAML needs PyYAML, which is not installed; pip install pyyaml"
        ) from None

    class Plain(yaml.SafeLoader):
        """Reads plain data; a tag of Python's becomes nothing instead of an object."""

    Plain.add_multi_constructor("tag:yaml.org,2002:python/", lambda *_: None)
    try:
        data = yaml.load(path.read_text(encoding="utf-8"), Plain)
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise InputError(f"{label(path)}: cannot be read as YAML: {' '.join(str(error).split())[:200]}") from None
    if not isinstance(data, dict):
        raise InputError(f"{label(path)}: expected a table, as Unitree and Isaac Lab write it")
    return data
