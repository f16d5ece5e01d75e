"""The law for any robot is, on the human, the law that knew the human alone.

`past.json` has what that law said, in commit 9e91ddd208a5b28d12281da5f4b1c787f7138203, the last before the law knew
other robots. There each gait walked for a second of `spatial/own` without jitter. Six states of that walk, 160 ms
apart, the third and the sixth moved off it by 30 mrad and 0.3 rad/s at random, were put before a new law as its first
six ticks: `spatial_tick` with the model, the record and MuJoCo's mechanics of `tests/control/space/scene.py`. Kept are
q, v, Q_d and the joint torques u, which are smoothed from tick to tick where the gait says so.

`human3d_steady` is newer than that law. It has what the law did not know, a pace and feet that are braked, as zeros.

With MuJoCo's mechanics no bit differs where this file was made. The law's own kernels and Pinocchio add the same
numbers in another order.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from tests.control.space.any_scene import AnyScene

PAST = json.loads(Path(__file__).with_name("past.json").read_text(encoding="utf-8"))
NEWER = {"human3d_steady": ("gains.pace={swing=0.0,stance=0.0}", "actuation.pushing.braking=0.0")}


@pytest.mark.parametrize("mechanics", ["compiled", "engine", "pinocchio"])
@pytest.mark.parametrize("gait", PAST)
def test_the_human_has_the_torques_of_the_law_before_it_knew_other_robots(gait, mechanics):
    scene = AnyScene("spatial/own", f'controller="{gait}"', f"control.mechanics={mechanics}", *NEWER.get(gait, ()))
    for tick, past in enumerate(PAST[gait]):
        scene.put(np.array(past["q"]), np.array(past["v"]))
        scene.sensed.begin(tick * scene.setup.tick)
        torques = scene.law.torques(scene.sensed)
        for now, then in ((torques, past["u"]), (scene.c["tick"]["Q_d"], past["Q_d"])):
            assert np.abs(now - then).max() <= 1e-9 * np.abs(then).max()
