"""Why two engines, or two settings of one, differ: one physical cause at a time is changed until they behave alike.

Behaviour is where the base and the joints of the legs are, from the same start until the two have parted: what comes
after that is chaos, of which any change makes another. What is left of the difference is relative to its size at the
same moment, so that the first micrometres, in which forces and masses tell one cause from another, count as much as the
last millimetres, in which everything moves along. A cause has one or more *dials*; each is turned over a few values,
and a continuous one then to where least is left. What a cause explains is the share that its best setting takes away.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import mujoco
import numpy as np
from msgspec import structs

from biped.base.errors import InputError
from biped.ensemble.campaign import simulate
from biped.measure.trajectory import Trajectory
from biped.robot.run import Run
from biped.scenario.engines import ENGINES
from biped.studies.comparison import apart
from biped.studies.run import plan_of

Edit = Callable[[mujoco.MjModel, float], None]
STEP = "simulation.timestep"


class Dial(NamedTuple):
    """A way to change a cause.

    Attributes:
        words: What a value of it is, with a place for the value.
        values: That are tried.
        edit: Changes the compiled model; or none, and the key does.
        key: Of the scenario.
        continuous: Whether it is turned further between them, on a logarithmic scale.
    """

    words: str
    values: tuple[Any, ...]
    edit: Edit | None = None
    key: str = ""
    continuous: bool = False


def _scale(*names: str) -> Edit:
    """Multiplies arrays of a model."""

    def edit(m: mujoco.MjModel, factor: float) -> None:
        for name in names:
            array = getattr(m, name)
            array[:] = array * factor

    return edit


def _constants(edit: Edit) -> Edit:
    """As an edit, and then all that follows from masses is computed anew."""

    def both(m: mujoco.MjModel, value: float) -> None:
        edit(m, value)
        mujoco.mj_setConst(m, mujoco.MjData(m))

    return both


def _contact_times(m: mujoco.MjModel, factor: float) -> None:
    for array in (m.pair_solref, m.geom_solref):
        positive = array[:, 0] > 0.0
        array[positive, 0] *= factor


def _damping_ratios(m: mujoco.MjModel, factor: float) -> None:
    for array in (m.pair_solref, m.geom_solref):
        array[array[:, 0] > 0.0, 1] *= factor


def _frictions(m: mujoco.MjModel, factor: float) -> None:
    m.pair_friction[:, :2] *= factor
    m.geom_friction[:, 0] *= factor


def _joints(m: mujoco.MjModel) -> np.ndarray:
    """Velocities of joints but those by which the base moves."""
    first = m.body_dofnum[1] + m.body_dofadr[1]
    return np.arange(first, m.nv)


def _add_damping(m: mujoco.MjModel, value: float) -> None:
    linear = m.dof_damping if m.dof_damping.ndim == 1 else m.dof_damping[:, 0]
    linear[_joints(m)] += value


def _no_damping(m: mujoco.MjModel, factor: float) -> None:
    m.dof_damping[_joints(m)] *= factor


def _add_armature(m: mujoco.MjModel, value: float) -> None:
    m.dof_armature[_joints(m)] += value


def _stop_times(m: mujoco.MjModel, factor: float) -> None:
    m.jnt_solref[m.jnt_solref[:, 0] > 0.0, 0] *= factor


def _without_stops(m: mujoco.MjModel, _: float) -> None:
    m.jnt_limited[:] = 0


def _base_mass(m: mujoco.MjModel, factor: float) -> None:
    heaviest = int(np.argmax(m.body_mass))
    m.body_mass[heaviest] *= factor
    m.body_inertia[heaviest] *= factor


_FACTORS = (0.1, 0.25, 0.5, 2.0, 4.0, 10.0)
_NEAR = (0.8, 0.9, 0.97, 1.03, 1.1, 1.25)
_SOME = (0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0)

CAUSES: dict[str, tuple[Dial, ...]] = {
    "contact time": (Dial("contact time × {:.3g}", _FACTORS, _contact_times, continuous=True),),
    "contact damping": (Dial("damping ratio × {:.3g}", _FACTORS, _damping_ratios, continuous=True),),
    "friction": (Dial("friction × {:.3g}", (0.02, 0.06, *_FACTORS), _frictions, continuous=True),),
    "joint damping": (
        Dial("{:.3g} N m s/rad in every joint besides", _SOME, _add_damping, continuous=True),
        Dial("damping × {:.3g}", (0.0, 0.5, 2.0), _no_damping),
    ),
    "armature": (
        Dial("{:.3g} kg m² at every joint besides", _SOME[:-1], _constants(_add_armature), continuous=True),
        Dial("armature × {:.3g}", (0.0, 0.5, 2.0), _constants(_scale("dof_armature"))),
    ),
    "joint limits": (
        Dial("limits' time × {:.3g}", _FACTORS, _stop_times, continuous=True),
        Dial("no limits", (0.0,), _without_stops),
    ),
    "gravity": (Dial("gravity × {:.4g}", _NEAR, lambda m, f: m.opt.gravity.__imul__(f), continuous=True),),
    "mass": (
        Dial("all masses × {:.4g}", _NEAR, _constants(_scale("body_mass", "body_inertia")), continuous=True),
        Dial("the heaviest link's mass × {:.4g}", _NEAR, _constants(_base_mass), continuous=True),
    ),
    "step": (Dial("step × {:g}", (0.1, 0.2, 0.25, 0.5, 2.0, 4.0, 5.0, 10.0), key=STEP),),
    "integrator": (Dial("{}", ("Euler", "implicitfast", "implicit", "RK4"), key="simulation.integrator"),),
    "solver": (
        Dial("{}", ("Newton", "CG", "PGS"), key="simulation.solver"),
        Dial("at most {} iterations", (1, 2, 3, 5, 10, 100), key="simulation.iterations"),
    ),
    "cone": (
        Dial("{}", ("elliptic", "pyramidal"), key="simulation.cone"),
        Dial("impratio {:g}", (1.0, 100.0), key="simulation.impratio"),
    ),
}  # fmt: skip
"""Physical causes that are changed, one at a time. Keys of the scenario where there is one for it."""


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
