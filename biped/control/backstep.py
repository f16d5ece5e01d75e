"""The step back: when a step is being lost, the leg in the air comes down behind instead of ahead.

Not in the thesis, but made of its parts: a leg state from contacts and motion, and a spring-damper couple.
"""

from __future__ import annotations

import math

from biped.base.jit import kernel
from biped.robot.model import GRAVITY


@kernel
def step_back(c, q, v):
    """Writes whether the walker falls back into the record, and if so state 4 (index 3) for legs in the air.

    It falls back while the torso's extrapolated centre of mass (Hof 2008), x + ẋ √(y/g) along the ground and taken
    vertically below the torso, is behind the rearmost believed contact by more than `margin`.
    """
    rear = math.inf
    for i in range(4):
        if c["believed"][i]:
            rear = min(rear, c["position"][i, 0])
    ahead = q[0] - q[1] * math.tan(c["tilt"]) + v[0] * math.sqrt(max(q[1], 0.0) / GRAVITY)
    c["back"] = ahead < rear - c["margin"] and rear < math.inf
    if c["back"]:
        for leg in range(2):
            if c["phase"][leg] >= 2:
                c["phase"][leg] = 3
