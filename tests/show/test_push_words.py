"""A push in one line, as it stands on the terminal."""

from __future__ import annotations

import math

from biped.scenario.metrics import METRICS
from biped.show.document import leg_words
from biped.show.results import PUSH_NAMES, push_words, sizes_of_pushes


def test_a_push_is_told_in_the_fields_units():
    none = dict.fromkeys(METRICS, math.nan)
    assert push_words(none) == ""
    pushed = none | {"push_impulse": 40.0, "push_speed": 40.0 / 75.0, "push_froude": 0.174}
    assert push_words(pushed) == "pushed with 40 N s, 0.533 m/s of the whole robot, 0.174 sqrt(g leg)"
    bounded = pushed | {"push_share": 0.618}
    assert push_words(bounded).endswith("sqrt(g leg), 62 % of the most that steps of a leg length could catch")
    recovered = pushed | {"recovery_time": 1.2, "first_step": 0.7, "second_step": 0.65}
    assert push_words(recovered).endswith("; recovered in 1.2 s; next steps 0.7, 0.65 m")
    assert push_words(dict.fromkeys(METRICS)) == ""


def test_legs_are_called_by_their_side():
    assert leg_words("right_ankle_roll_link") == "right leg"
    assert leg_words("left") == "left leg"
    assert leg_words("foot_a") == "foot a leg"
    assert leg_words("bright_sole") == "bright sole leg"


def test_pushes_either_way_are_told_by_their_size():
    either = sizes_of_pushes(
        [dict(zip(PUSH_NAMES, (way * 40.0, way * 0.5, way * 0.2), strict=True)) for way in (1, -1)]
    )
    assert either == {"push_impulse": 40.0, "push_speed": 0.5, "push_froude": 0.2}
    one_way = [dict(zip(PUSH_NAMES, (-size, -0.1, -0.1), strict=True)) for size in (20.0, 40.0)]
    assert sizes_of_pushes(one_way) == {}
    assert sizes_of_pushes([dict.fromkeys(PUSH_NAMES, math.nan)]) == {}
