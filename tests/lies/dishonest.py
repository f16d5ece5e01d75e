"""Runs that neither walk nor stand, however they look to one number: by number, from a seed."""

from __future__ import annotations

import random

from biped.studies.run import plan_of

Case = tuple[str, list[str], str]
"""Scenario, changes, kind."""

UPRIGHT = 1.5707963267948966
GAITS = ("calm/own", "robust/own", "upright/own", "level_normal", "level_fast", "level_slow_generalized")
ANY = ("any/h1", "any/humanoid", "any/walker2d", "spatial/own")
"""Robots of other kinds, and the human in space."""
SHARE = 0.2
"""Of the runs that are theirs."""
ANYWAY = ["fall.height=0.01", "fall.tilt=180.0"]
"""A run goes on however low it is and whichever way up."""
TORQUES = GAITS[:-1]
"""Those that walk by torques: limits of torques hold no generalized forces back."""
NO_TORQUE = "actuation.torque_limit=1e-9"


def dishonest(number: int) -> Case:
    """Scenario, changes and kind of a dishonest run."""
    r = random.Random(f"dishonest {number}")
    kind = r.choice(tuple(_KINDS))
    name, changes = _KINDS[kind](r)
    return name, changes, kind


def _who(r: random.Random) -> str:
    return r.choice(ANY) if r.random() < SHARE else r.choice(GAITS)


def _push(r: random.Random, name: str, forward: tuple[float, float], up: tuple[float, float], weight: float) -> str:
    """A push that does not end, in newtons for a human, and of the same share of the weight for another robot."""
    sideways = [] if name in GAITS or name == "any/walker2d" else [0.0]
    force = [round(weight * r.uniform(*forward), 2), *sideways, round(weight * r.uniform(*up), 2)]
    return f"push=[{{at=0.0,duration=5.0,force={force}}}]"


def _weight(name: str) -> float:
    """Of a robot, of the human's."""
    return 1.0 if name in GAITS else plan_of(name, []).robot.mass / 75.0


def _window(r: random.Random, start: float = 0.0) -> list[str]:
    end = r.uniform(start + 1.0, start + 3.0)
    return [f"duration={end:.3f}", f"window.start={start}", f"window.end={end:.3f}", "sweep={}", "randomise.runs=1",
            "randomise.draw={}"]  # fmt: skip


def _slide(r: random.Random) -> tuple[str, list[str]]:
    """Downhill on ice, by a gait that lifts its feet or by none."""
    changes = [f"ground.slope={-r.uniform(4.0, 44.0):.3g}", f"ground.friction={r.uniform(0.0, 0.03):.3g}"]
    if r.random() < 0.5:
        changes += ANYWAY
    if r.random() < 0.3:
        changes.append(NO_TORQUE)
    return _who(r), [*changes, "push=[]", *_window(r)]


def _sink(r: random.Random) -> tuple[str, list[str]]:
    """Ground as soft as mud."""
    return _who(r), [f"ground.contact_time={r.uniform(0.1, 1.0):.3g}",
                             f"ground.damping_ratio={r.uniform(0.5, 3.0):.3g}", *ANYWAY, *_window(r)]  # fmt: skip


def _glide(r: random.Random) -> tuple[str, list[str]]:
    """Thrown forward on ice, and lets its feet trail."""
    speed = f"start.v=[{r.uniform(1.0, 10.0):.3g},0,0,0,0,0,0,0,0]"
    return r.choice(GAITS), [speed, f"ground.friction={r.uniform(0.0, 0.02):.3g}", *ANYWAY, *_window(r)]


def _throw(r: random.Random) -> tuple[str, list[str]]:
    """Thrown through the air, with whatever its legs do meanwhile."""
    speed = f"start.v=[{r.uniform(1.0, 8.0):.3g},{r.uniform(12.0, 60.0):.3g},{r.uniform(-3.0, 3.0):.3g},0,0,0,0,0,0]"
    return r.choice(GAITS), [speed, *ANYWAY, *_window(r)]


def _roll(r: random.Random) -> tuple[str, list[str]]:
    """Turns over and over, downhill or by a push."""
    spin = f"start.v=[{r.uniform(1.0, 6.0):.3g},0,{-r.uniform(5.0, 20.0):.3g},0,0,0,0,0,0]"
    return r.choice(GAITS), [spin, f"ground.slope={-r.uniform(0.0, 40.0):.3g}", *ANYWAY, *_window(r)]


def _lie(r: random.Random) -> tuple[str, list[str]]:
    """Lies on the ground, without a torque or with those of its gait."""
    if r.random() < 0.3:
        name = r.choice(("any/humanoid", "any/h1", "any/walker2d"))
        return name, [NO_TORQUE, *ANYWAY, "duration=5.0", "window.start=3.5", "window.end=5.0", "randomise.runs=1"]
    changes = [*ANYWAY, "duration=5.0", "window.start=3.0", "window.end=5.0", "sweep={}", "randomise.runs=1"]
    return r.choice(TORQUES), [NO_TORQUE, f"ground.friction={r.uniform(0.3, 1.5):.3g}", *changes]


def _drag(r: random.Random) -> tuple[str, list[str]]:
    """Dragged along by a push that does not end, limp or with the legs of its gait."""
    name = _who(r)
    changes = [
        _push(r, name, (150.0, 600.0), (0.0, 300.0), _weight(name)),
        f"ground.friction={r.uniform(0.0, 0.2):.3g}",
    ]
    return name, [*changes, *ANYWAY, *_window(r), *([] if r.random() < 0.3 else [NO_TORQUE])]


def _hang(r: random.Random) -> tuple[str, list[str]]:
    """Borne by a push from above, in part or wholly."""
    name = _who(r)
    return name, [_push(r, name, (0.0, 200.0), (250.0, 735.0), _weight(name)), *ANYWAY, *_window(r)]


def _freeze(r: random.Random) -> tuple[str, list[str]]:
    """A moment of something else, too short to see that it is none of standing."""
    start = r.uniform(0.1, 3.0)
    window = [f"window.start={start:.3f}", f"window.end={start + r.uniform(0.005, 0.3):.3f}"]
    return _who(r), [f"duration={start + 1.0:.3f}", *window, "sweep={}", "randomise.runs=1", "randomise.draw={}"]


def _hop(r: random.Random) -> tuple[str, list[str]]:
    """Steps of one leg alone: the other has no torque and is dragged along, or both push at once."""
    limits = [1e-9] * 3 + [150.0] * 3
    r.shuffle(limits) if r.random() < 0.3 else None
    friction = f"ground.friction={r.uniform(0.0, 0.1):.3g}"
    return r.choice(TORQUES), [f"actuation.torque_limit={limits}", friction, *ANYWAY, *_window(r)]


_KINDS = {
    "slides": _slide, "sinks": _sink, "glides": _glide, "is thrown": _throw, "rolls": _roll, "lies": _lie,
    "is dragged": _drag, "hangs": _hang, "freezes": _freeze, "hops": _hop,
}  # fmt: skip
