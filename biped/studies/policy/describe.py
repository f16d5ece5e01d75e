"""A card from what trainers write: mjlab's metadata in an ONNX file, or a YAML file beside it."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from biped.base.errors import InputError
from biped.base.files import is_file, label, nearest
from biped.control.network import metadata
from biped.robot.report import look
from biped.studies.policy.deployed import of_yaml, term_of


def describe(
    network: Path, model: str, deploy: Path | None, rate: float | None, clock: float | None = None
) -> dict[str, Any]:
    """Returns a card for a network, as plain data.

    Args:
        network: The ONNX file.
        model: Name or path of the robot's model file.
        deploy: A YAML file beside it (`biped.studies.policy.deployed`); None: the network's own metadata say it.
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
