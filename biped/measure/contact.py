"""When a foot is on the ground, and when it strikes: by the ground's force alone, for every robot, engine and law.

A foot is on the ground while the normal force under it exceeds a share of the robot's weight. Contacts of rigid feet
chatter: the force drops to zero and returns a hundred times a second while the foot rests. So a loss of force shorter
than any swing does not lift the foot, and a touch as short does not set it down.

O. Tirosh and W. A. Sparrow (Journal of Applied Biomechanics 19, 2003) find that any threshold up to 50 N gives the time
of foot strike, and that toe-off needs one of 10 N or less. docs/results.md shows what the two numbers here change.
"""

from typing import Any

import numpy as np

from biped.robot.robot import Robot

LOADED = 0.01
"""Share of the robot's weight from which a foot is on the ground: 7 N of a human of 75 kg."""
SPELL = 0.05
"""[s] below which neither a loss of force lifts a foot nor a touch sets it down; a swing takes 0.2 s and more."""

Strike = tuple[int, int]
"""Row and foot."""


def feet_down(force: np.ndarray, weight: float, tick: float, share: float = LOADED, spell: float = SPELL) -> np.ndarray:
    """Whether each foot is on the ground.

    Args:
        force: (n, feet) [N] normal force under each foot in the step after each row.
        weight: [N] of the robot.
        tick: [s] between rows.
        share: Of the weight, from which a foot is on the ground.
        spell: [s] that a swing and a contact take at least.

    Returns:
        (n, feet) True while a foot is on the ground. Spells that the start or the end of the run cuts stay as they are.
    """
    loaded, least = force > share * weight, round(spell / tick)
    return np.stack([_lasting(_lasting(on, False, least), True, least) for on in loaded.T], axis=1)


def _lasting(on: np.ndarray, value: bool, least: int) -> np.ndarray:
    """(n,) flags whose spells of a value are at least so many rows long; shorter ones become their neighbours'."""
    cuts = np.flatnonzero(on[1:] != on[:-1]) + 1
    if len(cuts) < 2:
        return on
    first = np.concatenate([[0], cuts])
    length = np.diff(first, append=len(on))
    values = on[first]
    values[1:-1] ^= (values[1:-1] == value) & (length[1:-1] < least)
    return np.repeat(values, length)


def strikes_of(down: np.ndarray, tick: float, spell: float = SPELL) -> list[Strike]:
    """Foot strikes (row, foot) in time order: the first rows on the ground after a swing.

    Args:
        down: (n, feet) whether each foot is on the ground, of `feet_down`.
        tick: [s] between rows.
        spell: [s] that a swing takes at least; of one that began before the run, the part within it.
    """
    least = round(spell / tick)
    found = []
    for foot in range(down.shape[1]):
        lifts, lands = _edges(down[:, foot])
        if not down[0, foot]:
            lifts = np.concatenate([[0], lifts])
        found += [(int(land), foot) for lift, land in zip(lifts, lands, strict=False) if land - lift >= least]
    return sorted(found)


def swings_of(down: np.ndarray, foot: int) -> list[slice]:
    """Rows of the whole swings of a foot: those that the start or the end of the rows cuts are left out."""
    lifts, lands = _edges(down[:, foot])
    if not down[0, foot]:
        lands = lands[1:]
    return [slice(int(lift), int(land)) for lift, land in zip(lifts, lands, strict=False)]


def _edges(on: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First rows off the ground and on it again, of flags (n,)."""
    return np.flatnonzero(on[:-1] & ~on[1:]) + 1, np.flatnonzero(on[1:] & ~on[:-1]) + 1


def along_feet(robot: Robot) -> np.ndarray:
    """(P,) where the contact points stand along their feet, 0 heel … 1 toe; of a foot of one point 0."""
    out = []
    for foot in robot.feet:
        x = np.array(foot.points)[:, 0]
        out.append((x - x.min()) / (np.ptp(x) or 1.0))
    return np.concatenate(out)


def ends(robot: Robot, values: np.ndarray, of: Any = np.mean) -> np.ndarray:
    """(n, 4, …) toe and heel of each foot: means, or what `of` makes, of values (n, P, …) of the halves of its points.

    Args:
        robot: Whose feet.
        values: Of its contact points.
        of: Reduces an array over its axis 1.
    """
    along, feet, parts = along_feet(robot), robot.of_foot, []
    for foot in range(len(robot.feet)):
        mine = feet == foot
        front, rear = mine & (along >= 0.5), mine & (along < 0.5)
        parts += [of(values[:, half if half.any() else mine], axis=1) for half in (front, rear)]
    return np.stack(parts, axis=1)
