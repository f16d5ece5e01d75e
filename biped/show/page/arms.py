"""Arms of a stick figure: lines from the shoulders along whatever hangs on the trunk and is no leg."""

from __future__ import annotations

from itertools import pairwise

import mujoco
import numpy as np

from biped.measure.trajectory import Trajectory

_MIDLINE = 0.03
"""Share of a leg's length from the trunk's middle within which a part is a neck or a head, not an arm."""


def arms_of(t: Trajectory, model: mujoco.MjModel, rows: np.ndarray) -> tuple[np.ndarray, list[tuple[int, ...]]]:
    """Points of the arms and the lines that join them.

    Args:
        t: The run.
        model: Of its robot.
        rows: (m,) rows of the run.

    Returns:
        Points (m, k, 3) [m] in the ground's frame, and each line's numbers of points, of the right arm first.
    """
    data, q = mujoco.MjData(model), t.qpos(model)[rows]
    data.qpos[:] = q[0]
    mujoco.mj_kinematics(model, data)
    chains = [chain for chain in _chains(t, model) if _beside(t, model, data, chain)]
    chains.sort(key=lambda chain: float(data.xpos[chain[-1]][1]))
    numbers = [body for chain in chains for body in chain]
    place = np.empty((len(rows), len(numbers) + len(chains), 3))
    last = [chain[-1] for chain in chains]
    for row, pose in zip(place, q, strict=True):
        data.qpos[:] = pose
        mujoco.mj_kinematics(model, data)
        row[: len(numbers)] = data.xpos[numbers]
        row[len(numbers) :] = 2.0 * data.xipos[last] - data.xpos[last]  # the mass is in the middle of the last part
    lines, first = [], 0
    for i, chain in enumerate(chains):
        lines.append((*range(first, first + len(chain)), len(numbers) + i))
        first += len(chain)
    if len(lines) == 2:
        lines.append((lines[0][0], lines[1][0]))
    return place, lines


def _chains(t: Trajectory, model: mujoco.MjModel) -> list[list[int]]:
    """Bodies from where a limb leaves the trunk to its end, of limbs that carry no foot."""
    parent, legs = model.body_parentid, set()
    for foot in t.robot.feet:
        for part in foot.bodies:
            body = part
            while body > 0 and body not in legs:
                legs.add(body)
                body = int(parent[body])
    free = [body for body in range(1, model.nbody) if body not in legs and _hangs_on(parent, body, t.robot.base_number)]
    branches = {body: sum(1 for child in free if parent[child] == body) for body in {*free, *legs}}
    chains = []
    for leaf in (body for body in free if not branches[body]):
        chain, body = [leaf], int(parent[leaf])
        while body in free and branches[body] == 1:
            chain.insert(0, body)
            body = int(parent[body])
        chains.append(chain)
    return chains


def _hangs_on(parent: np.ndarray, body: int, base: int) -> bool:
    while body > 0 and body != base:
        body = int(parent[body])
    return body == base


def _beside(t: Trajectory, model: mujoco.MjModel, data: mujoco.MjData, chain: list[int]) -> bool:
    """Whether a chain is an arm: it has an extent, and lies beside the trunk's middle."""
    points = [*data.xpos[chain], 2.0 * data.xipos[chain[-1]] - data.xpos[chain[-1]]]
    long = sum(float(np.linalg.norm(b - a)) for a, b in pairwise(points))
    aside = max(abs(float(point[1] - data.xpos[t.robot.base_number][1])) for point in points)
    return long > 0.2 * t.robot.leg and aside > _MIDLINE * t.robot.leg
