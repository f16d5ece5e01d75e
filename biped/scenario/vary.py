"""Changing single keys of a scenario: points of a sweep, draws of an ensemble, random forces, values after `--set`."""

import json
import math
import re
import zlib
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple, get_type_hints

import msgspec
import numpy as np
from msgspec.structs import replace

from biped.base.errors import InputError, echo, safe, short
from biped.base.files import nearest
from biped.base.typed import convert
from biped.scenario.keys import Scenario
from biped.scenario.possible import possible
from biped.scenario.randomise import Distribution, Normals, NormalStream
from biped.scenario.valid import humane
from biped.scenario.world import Push

FIXED = (
    "randomise", "sweep", "seed", "expect", "thesis", "window", "engine", "law", "law_sha256", "description",
    "threshold", "failures", "tune", "standard",
)  # fmt: skip
"""Sections that say what a campaign is and cannot vary within it."""

ENTRY = re.compile(r"[0-9]{1,8}")
"""The number of an entry of a list, as keys name it."""


class ChangeOrigin(NamedTuple):
    """Who asks for a key to change.

    Attributes:
        key: The scenario key where that is written, such as `sweep`.
        run: Number of the run that it is asked for, if it is asked for one.
    """

    key: str
    run: int | None = None

    def fault(self, what: str) -> InputError:
        """The error of what was asked for; the file is named by whoever knows it."""
        return InputError(f"{self.key}{'' if self.run is None else f', run {self.run}'}{what}", self.key)


SWEEP, DRAW = ChangeOrigin("sweep"), ChangeOrigin("randomise.draw")


def run_seed(seed: int, index: int) -> int:
    """The seed of run `index` of a scenario with `seed`."""
    return int(np.random.SeedSequence([seed, index]).generate_state(1)[0])


def stream(seed: int, name: str) -> Any:
    """An independent stream of random numbers for one purpose, so that a new purpose never changes an old one.

    It is a `numpy.random.Generator`, or of a seed whose normals are moved a `biped.scenario.randomise.NormalStream`.
    """
    key = zlib.crc32(name.encode())
    return seed.stream(key) if isinstance(seed, Normals) else np.random.default_rng([seed, key])


class Points(Sequence[dict[str, Any]]):
    """The points of a sweep, the last key varying fastest; each is made when it is asked for.

    Args:
        sweep: Values by key; without any there is one empty point.
    """

    def __init__(self, sweep: Mapping[str, Sequence[Any]]):
        self._sweep = sweep

    def __len__(self) -> int:
        return math.prod(map(len, self._sweep.values()))

    def __getitem__(self, index: Any) -> Any:
        if isinstance(index, slice):
            return [self[i] for i in range(*index.indices(len(self)))]
        if not -len(self) <= index < len(self):
            raise IndexError(index)
        index %= len(self)
        point = {}
        for key, values in reversed(list(self._sweep.items())):
            index, place = divmod(index, len(values))
            point[key] = values[place]
        return {key: point[key] for key in self._sweep}

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Sequence) and list(self) == list(other)

    __hash__ = None  # type: ignore[assignment]


def points_of(scenario: Scenario) -> Points:
    """The points of the scenario's sweep; one empty point without a sweep."""
    return Points(scenario.sweep)


def drawn(scenario: Scenario, index: int, seed: int) -> dict[str, Any]:
    """The values that run `index` with its `seed` draws, by key."""
    values = {}
    for key, distribution in scenario.randomise.draw.items():
        there = lookup(scenario, key, DRAW)
        size = len(there) if isinstance(there, tuple) else None
        values[key] = _draw(distribution, seed, key, index, size)
    return values


def _draw(d: Distribution, seed: int, key: str, index: int, size: int | None) -> Any:
    if d.grid is not None:
        return d.grid[index % len(d.grid)]
    rng = stream(seed, f"draw.{key}")
    if d.choice is not None:
        return d.choice[int(rng.integers(len(d.choice)))]
    if d.normal is not None:
        mean, deviation = d.normal
        value = rng.normal(mean, abs(deviation), size)  # numpy takes -0.0 for less than zero
    else:
        assert d.uniform is not None
        value = rng.uniform(*d.uniform, size)
    return value.tolist() if size is not None else float(value)


def lookup(scenario: Scenario, key: str, asked: ChangeOrigin) -> Any:
    """The value at a dotted key of a scenario.

    Raises:
        InputError: There is no such key.
    """
    at: Any = scenario
    parts = key.split(".")
    for i, part in enumerate(parts):
        if isinstance(at, msgspec.Struct):
            known = at.__struct_fields__
            if part not in known or (i == 0 and part in FIXED):
                known = [name for name in known if i > 0 or name not in FIXED]
                what = f"no key '{safe(part)}' that can vary; {nearest(part, known)}"
                raise asked.fault(f'."{safe(key)}": {what}')
            at = getattr(at, part)
        elif isinstance(at, tuple):
            if not (ENTRY.fullmatch(part) and int(part) < len(at)):
                there = f"0 … {len(at) - 1}" if at else "of an entry, of which there are none,"
                what = f"expected an index {there} instead of '{safe(part)}'"
                raise asked.fault(f'."{safe(key)}": {what}')
            at = at[int(part)]
        else:
            there = ".".join(parts[:i])
            raise asked.fault(f".\"{safe(key)}\": '{safe(part)}' is below a single value; expected {safe(there)}")
    return at


@cache
def _hints() -> dict[str, Any]:
    return get_type_hints(Scenario, include_extras=True)


def with_values(scenario: Scenario, values: Mapping[str, Any], asked: ChangeOrigin) -> Scenario:
    """The scenario with some keys changed.

    Raises:
        InputError: A key does not exist or the value is not possible for it.
    """
    if not values:
        return scenario

    def fault(what: str) -> InputError:
        shown = short(", ".join(f"{safe(key)} = {echo(value)}" for key, value in values.items()), 300)
        return asked.fault(f": {shown}: {what}")

    for key, value in values.items():
        lookup(scenario, key, asked)
        first, *rest = key.split(".")
        if not _is_finite(value):
            raise fault("expected finite numbers")
        # Only the section that changes is looked at again: this is what every run of a campaign costs.
        section = msgspec.to_builtins(getattr(scenario, first)) if rest else value
        if rest:
            section = _replaced(section, rest, value)
        try:
            typed = convert(section, _hints()[first])
        except msgspec.ValidationError as error:
            raise fault(humane(str(error).partition(" - at ")[0])) from None
        scenario = msgspec.structs.replace(scenario, **{first: typed})
    possible(scenario, lambda key, what: fault(f"{key}: {what}"))
    return scenario


def _replaced(at: Any, path: Sequence[str], value: Any) -> Any:
    """Plain data with the value at a path that exists replaced."""
    if not path:
        return value
    first, *rest = path
    if isinstance(at, dict):
        return at | {first: _replaced(at[first], rest, value)}
    place = int(first)
    return [*at[:place], _replaced(at[place], rest, value), *at[place + 1 :]]


def _is_finite(value: Any) -> bool:
    if isinstance(value, list | tuple):
        return all(map(_is_finite, value))
    return not isinstance(value, float) or math.isfinite(value)


def setting(key: str, value: Any) -> str:
    """A change as `KEY=VALUE`.

    Args:
        key: Dotted key of a scenario.
        value: Number, string, path, sequence, array or mapping of such.

    Raises:
        InputError: The value is none of these.
    """
    return f"{key}={_toml(key, value)}"


def _toml(key: str, value: Any) -> str:
    if hasattr(value, "tolist"):  # numpy's numbers and arrays
        value = value.tolist()
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int | float):
        return repr(value)
    if isinstance(value, str | Path):
        return json.dumps(str(value), ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, Mapping):
        items = (f"{_name(str(name))} = {_toml(f'{key}.{name}', inner)}" for name, inner in value.items())
        return "{" + ", ".join(items) + "}"
    if isinstance(value, list | tuple | range):
        return "[" + ", ".join(_toml(key, inner) for inner in value) + "]"
    raise InputError(f"{key}: expected a number, a string, a list or a table, got {type(value).__name__} {value!r:.60}")


def _name(text: str) -> str:
    return text if re.fullmatch(r"[\w-]+", text, re.ASCII) else json.dumps(text, ensure_ascii=False)


PIECES = 10
"""In a correlation time."""


def disturbed(s: Scenario, seed: int) -> Scenario:
    """The scenario of a run with its random force among the pushes.

    The process is sampled exactly: x' = ρ x + √(1 − ρ²) z with ρ = exp(−h / τ) from piece to piece of h, and
    stationary from the first (D. T. Gillespie, Phys. Rev. E 54:2084, 1996).

    Args:
        s: The scenario.
        seed: The run's, from which the force is drawn: twice the strength is twice the same force.
    """
    given = s.disturbance
    if given is None:
        return s
    start, z = piece_times(s), piece_normals(s, seed)
    rho = math.exp(-(start[1] - start[0]) / given.correlation) if len(start) > 1 else 0.0
    force = np.empty_like(z)
    force[0] = z[0]
    for k in range(1, len(z)):
        force[k] = rho * force[k - 1] + math.sqrt(1.0 - rho * rho) * z[k]
    force *= np.array(given.force)
    ends = np.append(start[1:], s.duration)
    pushes = (
        Push(at=float(a), duration=float(b - a), force=tuple(map(float, one)), body=given.body)
        for a, b, one in zip(start, ends, force, strict=True)
    )
    return replace(s, push=(*s.push, *pushes))


def piece_times(s: Scenario) -> np.ndarray:
    """(n,) [s] at which the pieces of a scenario's random force begin, whole ticks; empty without one."""
    if s.disturbance is None:
        return np.empty(0)
    tick = 1.0 / s.simulation.control_rate
    each = max(1, round(s.disturbance.correlation / PIECES / tick))
    first, count = round(s.disturbance.at / tick), round(s.duration / tick)
    return np.arange(first, max(count, first + 1), each) * tick


def piece_normals(s: Scenario, seed: int) -> np.ndarray:
    """(n, directions) normal numbers that the pieces of a run's random force are made of; empty without one."""
    start = piece_times(s)
    rng = stream(seed, "disturbance")
    size = (len(start), len(s.disturbance.force) if s.disturbance else 0)
    return rng.standard_normal(size, start) if isinstance(rng, NormalStream) else rng.standard_normal(size)
