"""A card from what trainers write: mjlab's metadata in an ONNX file, or a YAML file beside it.

The YAML file is Unitree's deploy.yaml, or Isaac Lab's IO descriptors.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from biped.base.errors import InputError, why
from biped.base.files import is_file, label, nearest
from biped.control.network import metadata
from biped.robot.report import look
from biped.robot.robot import Robot


def describe(
    network: Path, model: str, deploy: Path | None, rate: float | None, clock: float | None = None
) -> dict[str, Any]:
    """Returns a card for a network, as plain data.

    Args:
        network: The ONNX file.
        model: Name or path of the robot's model file.
        deploy: A YAML file beside it; None: the network's own metadata say it.
        rate: [Hz] at which the network is asked, where nothing else says it.
        clock: [Hz] of the phase that it sees, likewise.

    Raises:
        InputError: Something is missing, by name, or cannot be understood.
    """
    if not is_file(network):
        raise InputError(f"policy: no file '{network}'; expected an ONNX network")
    found = look(model)
    path, robot = found.file, found.robot
    if robot is None:
        raise InputError(f"{label(path)}: {'; '.join(found.faults)}", "model")
    if deploy is not None:
        card = of_yaml(deploy, robot)
    elif data := metadata(network):
        card = _of_metadata(data, label(network))
    else:
        raise InputError(f"{label(network)}: has no metadata: expected a card that says what it sees "
                         "(docs/your-policy.md), or --deploy deploy.yaml")  # fmt: skip
    if rate is not None:
        card["rate"] = rate
    if "rate" not in card:
        raise InputError(f"{label(network)}: rate: its metadata do not say how often it is asked; expected --rate in "
                         "Hz, such as --rate 50")  # fmt: skip
    if clock is not None:
        card["clock"] = {"frequency": clock}
    if "clock" not in card and any(term["term"].startswith("clock") for term in card["observation"]):
        raise InputError(f"{label(network)}: clock: it sees a phase, and nothing says how fast that goes; expected "
                         "--clock in Hz, such as --clock 1.25")  # fmt: skip
    return {"network": network.name, **card, "scenario": {"model": _named(model, path, network.resolve().parent)}}


def _named(model: str, file: Path, folder: Path) -> str:
    """A model as a card in a folder names it: a file below that folder from there, so that both can be moved."""
    if not is_file(Path(model)):
        return model
    whole = file.resolve()
    return whole.relative_to(folder).as_posix() if whole.is_relative_to(folder) else str(whole)


def _of_metadata(data: Mapping[str, str], name: str) -> dict[str, Any]:
    """A card from mjlab's metadata: words and numbers with commas between them."""

    def words(key: str) -> list[str]:
        if key not in data:
            hint = nearest(key, list(data))
            raise InputError(f"{name}: metadata: expected '{key}', which mjlab writes; {hint}")
        return [word.strip() for word in data[key].split(",") if word.strip()]

    def numbers(key: str) -> list[float]:
        return [_number(word, name, key) for word in words(key)]

    seen = words("observation_names")
    action: dict[str, Any] = {"scale": numbers("action_scale")}
    if "joint_stiffness" in data:
        action |= {"stiffness": numbers("joint_stiffness"), "damping": numbers("joint_damping")}
    joints = words("joint_names")
    scales, lengths = (_each(data.get(key), len(seen), name, key) for key in (
        "observation_terms_scale", "observation_terms_history_length"))  # fmt: skip
    if len(set(action["scale"])) == 1:
        action["scale"] = action["scale"][0]
    return {
        "joints": joints,
        "default": numbers("default_joint_pos"),
        "action": action,
        "observation": [
            term_of(term, name, scale, length) for term, scale, length in zip(seen, scales, lengths, strict=True)
        ],
        "source": {"metadata": "of the ONNX file, as mjlab writes them: numbers of three decimals"},
    }


def _each(text: str | None, count: int, name: str, key: str) -> Sequence[float | None]:
    """One number for each term; None where nothing is said."""
    if text is None:
        return (None,) * count
    words = [word.strip() for word in text.split(",")]
    if len(words) != count:
        raise InputError(
            f"{name}: metadata: {key}: expected {count} numbers, one for each observation, got {len(words)}"
        )
    return [None if word in ("", "None") else _number(word, name, key) for word in words]


def _number(word: str, name: str, key: str) -> float:
    try:
        return float(word)
    except ValueError:
        raise InputError(
            f"{name}: metadata: {key}: expected numbers with commas between them, got '{word[:40]}'"
        ) from None


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
        raise InputError(f"{label(path)}: cannot be read as YAML: {why(error)}") from None
    if not isinstance(data, dict):
        raise InputError(f"{label(path)}: expected a table, as Unitree and Isaac Lab write it")
    return data
