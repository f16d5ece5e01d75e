"""A policy network that walks: the gait calm's torques, learned by imitation (`distill.py` beside this file).

biped run calm/own --set law=controllers/policy/walker.py:Walker --set actuation.contacts=released
"""

from biped.control.policy import Policy

POINTS = ("right_toe", "right_heel", "left_toe", "left_heel")
JOINTS = ("right_hip", "right_knee", "right_ankle", "left_hip", "left_knee", "left_ankle")


class Walker(Policy):
    """Two hidden layers of 96; asked at every tick."""

    network = "walker.onnx"
    observations = (
        "q.root_z", "q.root_pitch", *(f"q.{joint}" for joint in JOINTS),
        "v.root_x", "v.root_z", "v.root_pitch", *(f"v.{joint}" for joint in JOINTS),
        *(f"height.{point}" for point in POINTS), *(f"contact.{point}" for point in POINTS),
        *(f"touching.{name}" for name in (*POINTS, "right_knee", "left_knee")),
        "Q_d.root_pitch", *(f"Q_d.{joint}" for joint in JOINTS),
        *(f"state.{leg}.{state}" for leg in ("right", "left") for state in (1, 2, 3, 4)),
    )  # fmt: skip
    scale = 50.0  # N m
