"""Why two engines, or two settings of one, differ: one physical cause at a time is changed until they behave alike.

Behaviour is where the base and the joints of the legs are, from the same start until the two have parted: what comes
after that is chaos, of which any change makes another. What is left of the difference is relative to its size at the
same moment, so that the first micrometres, in which forces and masses tell one cause from another, count as much as the
last millimetres, in which everything moves along. A cause has one or more *dials* (`biped.studies.dials`); each is
turned over a few values, and a continuous one then to where least is left. What a cause explains is the share that its
best setting takes away.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from msgspec import structs

from biped.base.errors import InputError
from biped.ensemble.campaign import simulate
from biped.measure.trajectory import Trajectory
from biped.robot.run import Run
from biped.scenario.engines import ENGINES
from biped.studies.comparison import apart
from biped.studies.dials import CAUSES, STEP, Dial
from biped.studies.run import plan_of

LEAST, MOST = 0.05, 3.0
"""[s] of behaviour that is compared, at least and at most."""
FAR = 0.01
"""[m] until which two walkers are compared: what a setting does is smooth as long as they are so close."""
EVERY = 0.005
"""[s] between places that are compared."""
EXPLAINED = 0.5
"""Share of the difference that a cause must take away to be named."""
CLOSE = (2.0, 0.02)
"""A cause cannot be told from the best if it leaves at most so many times as much, and this share besides."""
TURNS = 12
"""Runs in which a continuous dial is turned to where the difference is least."""
SAME = 1e-9
"""[m] below which two behave the same."""


class CauseTried(NamedTuple):
    """A cause at its best setting.

    Attributes:
        cause: Its name.
        setting: What was changed, in words.
        left: Share of the difference that is left, a root mean square over time; more than 1 where it is worse.
        parted_at: [s] when walkers are now 1 cm apart; nan if they are not while they are compared.
    """

    cause: str
    setting: str
    left: float
    parted_at: float

    @property
    def explained(self) -> float:
        """Share of the difference that it takes away; 0 where it only makes it worse."""
        return max(0.0, 1.0 - self.left)


class Why(NamedTuple):
    """The causes of a difference.

    Attributes:
        scenario: Its name.
        moved: What was changed: an engine.
        towards: What it should behave like.
        difference: [m] root mean square, over `seconds`.
        seconds: [s] of behaviour that is compared.
        tried: Causes, the one that leaves least first.
    """

    scenario: str
    moved: str
    towards: str
    difference: float
    seconds: float
    tried: list[CauseTried]

    @property
    def named(self) -> list[str]:
        """Names of causes that explain the difference: one, or several that cannot be told apart; or none."""
        if self.difference < SAME or not self.tried or self.tried[0].explained < EXPLAINED:
            return []
        most = CLOSE[0] * self.tried[0].left + CLOSE[1]
        return [one.cause for one in self.tried if one.left <= most and one.explained >= EXPLAINED]

    def verdict(self) -> str:
        """One sentence."""
        if self.difference < SAME:
            return f"{self.moved} and {self.towards} behave the same in {self.scenario}"
        size = f"{1e3 * self.difference:.3g} mm in the first {self.seconds:.2f} s"
        if not self.named:
            best = self.tried[0]
            return (f"no cause alone: of {size}, {best.cause} ({best.setting}) explains the most, "
                    f"{100 * best.explained:.0f} %")  # fmt: skip
        best = self.tried[0]
        others = "" if len(self.named) == 1 else f"; {', '.join(self.named[1:])} cannot be told from it"
        return f"{best.cause}: {best.setting} explains {100 * best.explained:.1f} % of {size}{others}"

    def as_dict(self) -> dict[str, Any]:
        """Plain data, as causes.json holds it."""
        return self._asdict() | {
            "tried": [one._asdict() | {"explained": one.explained} for one in self.tried],
            "named": self.named, "verdict": self.verdict(),
        }  # fmt: skip


class Departure:
    """The difference of a walker's behaviour from another's, moment by moment.

    Args:
        towards: The other.
        seconds: [s] from the start that are compared.
    """

    def __init__(self, towards: Trajectory, seconds: float):
        self._seconds, self._places = seconds, _places(towards, seconds)

    def of(self, t: Trajectory) -> np.ndarray:
        """(n,) [m] root mean square of base and joints; what ends early stays where it was then."""
        places = _places(t, self._seconds)
        n = max(len(places), len(self._places))
        mine, theirs = (np.concatenate([p, np.repeat(p[-1:], n - len(p), axis=0)]) for p in (places, self._places))
        return np.sqrt(np.mean(np.sum((mine - theirs) ** 2, axis=2), axis=1))


def _places(t: Trajectory, seconds: float) -> np.ndarray:
    """(n, 8, 3) [m] base, joints of the legs and end of the trunk at equal times."""
    rows = np.unique(np.round(np.arange(0.0, seconds, EVERY) / t.tick).astype(int))
    rows = rows[rows < len(t)]
    return np.concatenate([t.base[rows, None, :3], t.figure[rows]], axis=1)


def _size(away: np.ndarray) -> float:
    return float(np.sqrt(np.mean(away**2)))


def simulated(run: Run) -> Trajectory:
    """Simulates a run; what blows up overflows, and is far away then."""
    with np.errstate(all="ignore"):
        return simulate(run)


class _Search:
    """Tries settings of an engine against a behaviour.

    Args:
        name: Name or path of the scenario.
        changes: Of the engine that is moved.
        towards: What it should behave like.
    """

    def __init__(self, name: str, changes: Sequence[str], towards: Trajectory):
        self._name, self._changes, self._towards = name, list(changes), towards
        start = simulated(self._run(MOST))
        far = apart(start, towards) > FAR
        self.seconds = min(max(LEAST, 1.1 * float(start.time[np.argmax(far)])), MOST) if far.any() else MOST
        self._from = Departure(towards, self.seconds)
        away = self._from.of(start)
        self.difference, self._scale = _size(away), np.maximum.accumulate(away)

    def _run(self, seconds: float, *more: str) -> Run:
        """Run 0 of the engine that is moved, as long as it is looked at; what the scenario says of later stays."""
        run = plan_of(self._name, [*self._changes, *more]).run(0)
        lasts = min(run.scenario.duration, seconds + EVERY)
        return replace(run, scenario=structs.replace(run.scenario, duration=lasts))

    def left(self, dial: Dial, value: Any) -> tuple[float, float] | None:
        """The share of the difference that a setting leaves, and when walkers part; None where it cannot be run."""
        edit = dial.edit
        try:
            if edit is None:
                run = self._run(self.seconds, f"{dial.key}={self._step * value if dial.key == STEP else value}")
            else:
                run = replace(self._run(self.seconds), edit=lambda m: edit(m, value))
            t = simulated(run)
        except InputError:
            return None
        far = apart(t, self._towards) > FAR
        away = self._from.of(t)
        n = min(len(away), len(self._scale))
        there = self._scale[:n] > SAME
        left = _size(away[:n][there] / self._scale[:n][there])
        return (left, float(t.time[np.argmax(far)]) if far.any() else math.nan) if math.isfinite(left) else None

    @property
    def _step(self) -> float:
        """[s] of the physics."""
        return plan_of(self._name, self._changes).scenario.simulation.timestep

    def best(self, cause: str, dials: Sequence[Dial]) -> CauseTried | None:
        """The best setting of a cause."""
        found: list[tuple[float, float, str]] = []
        for dial in dials:
            found += [(left, at, dial.words.format(value)) for value, left, at in self._turned(dial)]
        if not found:
            return None
        left, at, setting = min(found, key=lambda one: one[0])
        return CauseTried(cause, setting, left, at)

    def _turned(self, dial: Dial) -> Iterator[tuple[Any, float, float]]:
        """Values of a dial that were tried, each with what is left and when walkers part."""
        tried = [(value, *found) for value in dial.values if (found := self.left(dial, value)) is not None]
        yield from tried
        if not dial.continuous or not tried:
            return
        values = sorted([*(value for value, *_ in tried), *((1.0,) if "×" in dial.words else ())])
        best = min(tried, key=lambda one: one[1])
        neutral = "×" in dial.words and best[1] >= 1.0  # every value tried only makes it worse
        at = values.index(1.0 if neutral else best[0])
        low = math.log(values[max(at - 1, 0)] * (0.5 if at == 0 else 1.0))
        high = math.log(values[min(at + 1, len(values) - 1)] * (2.0 if at == len(values) - 1 else 1.0))
        yield from self._narrowed(dial, low, high)

    def _narrowed(self, dial: Dial, low: float, high: float) -> Iterator[tuple[Any, float, float]]:
        """Golden section between two logarithms."""
        golden = 0.5 * (math.sqrt(5.0) - 1.0)
        inner = [high - golden * (high - low), low + golden * (high - low)]
        heights = []
        for at in inner:
            value, found = math.exp(at), self.left(dial, math.exp(at))
            heights.append(math.inf if found is None else found[0])
            if found is not None:
                yield value, *found
        for _ in range(TURNS):
            if heights[0] < heights[1]:
                high, inner[1], heights[1] = inner[1], inner[0], heights[0]
                inner[0], side = high - golden * (high - low), 0
            else:
                low, inner[0], heights[0] = inner[0], inner[1], heights[1]
                inner[1], side = low + golden * (high - low), 1
            found = self.left(dial, math.exp(inner[side]))
            heights[side] = math.inf if found is None else found[0]
            if found is not None:
                yield math.exp(inner[side]), *found


def causes(
    name: str, changes: Sequence[str], towards: Trajectory, moved: str, called: str,
    told: Callable[[CauseTried], None] = lambda _: None,
) -> Why:  # fmt: skip
    """Changes one cause at a time in the engine of a scenario until it behaves like another run.

    Args:
        name: Name or path of the scenario.
        changes: Of the engine that is moved.
        towards: Run 0 of what it should behave like.
        moved: What is moved, in words.
        called: What it should behave like, in words.
        told: Told of every cause that was tried.
    """
    search = _Search(name, changes, towards)
    tried = []
    for cause, dials in CAUSES.items() if search.difference >= SAME else ():
        found = search.best(cause, dials)
        if found is not None:
            tried.append(found)
            told(found)
    tried.sort(key=lambda one: one.left)
    return Why(name, moved, called, search.difference, search.seconds, tried)


def movable(engines: Sequence[str]) -> str:
    """The first engine whose contacts give way, in which all causes can be changed.

    Raises:
        InputError: None is.
    """
    for engine in engines:
        if not ENGINES[engine].rigid:
            return engine
    raise InputError("--why: expected an engine whose contacts give way among --engines, such as mujoco")
