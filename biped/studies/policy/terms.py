"""Names that trainers give to the terms of an observation, and what a card calls them."""

from __future__ import annotations

from typing import Any

from biped.base.errors import InputError
from biped.base.files import nearest

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
