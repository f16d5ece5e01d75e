"""Changing single keys of a scenario: the points of a sweep and the draws of an ensemble."""

from __future__ import annotations

import itertools
import zlib
from collections.abc import Mapping
from typing import Any

import msgspec
import numpy as np

from biped.base.errors import InputError
from biped.base.files import nearest
from biped.scenario.keys import Distribution, Scenario
from biped.scenario.valid import humane, possible

FIXED = (
    "randomise", "sweep", "seed", "expect", "thesis", "window", "engine", "law", "description", "threshold", "tune",
)  # fmt: skip
"""Sections that say what a campaign is and cannot vary within it."""


def run_seed(seed: int, index: int) -> int:
    """The seed of run `index` of a scenario with `seed`."""
    return int(np.random.SeedSequence([seed, index]).generate_state(1)[0])


def stream(seed: int, name: str) -> np.random.Generator:
    """An independent stream of random numbers for one purpose, so that a new purpose never changes an old one."""
    return np.random.default_rng([seed, zlib.crc32(name.encode())])


def points_of(scenario: Scenario) -> list[dict[str, Any]]:
    """The points of the scenario's sweep, the last key varying fastest; one empty point without a sweep."""
    keys = list(scenario.sweep)
    return [dict(zip(keys, values, strict=True)) for values in itertools.product(*scenario.sweep.values())]


def drawn(scenario: Scenario, index: int, seed: int) -> dict[str, Any]:
    """The values that run `index` with its `seed` draws, by key."""
    values = {}
    for key, distribution in scenario.randomise.draw.items():
        values[key] = _draw(distribution, stream(seed, f"draw.{key}"), index, _size(scenario, key))
    return values


def _size(scenario: Scenario, key: str) -> int | None:
    value = lookup(msgspec.to_builtins(scenario), key, "randomise.draw")
    return len(value) if isinstance(value, list | tuple) else None


def _draw(d: Distribution, rng: np.random.Generator, index: int, size: int | None) -> Any:
    if d.grid is not None:
        return d.grid[index % len(d.grid)]
    if d.choice is not None:
        return d.choice[int(rng.integers(len(d.choice)))]
    if d.normal is not None:
        value = rng.normal(*d.normal, size)
    else:
        assert d.uniform is not None  # a distribution is one of the four
        value = rng.uniform(*d.uniform, size)
    return value.tolist() if size is not None else float(value)


def lookup(data: Any, key: str, asked_by: str) -> Any:
    """The value at a dotted key of a scenario as plain data.

    Raises:
        InputError: There is no such key.
    """
    at = data
    parts = key.split(".")
    for i, part in enumerate(parts):
        if isinstance(at, dict):
            known = [name for name in at if i > 0 or name not in FIXED]
            if part not in known:
                raise _fault(f"{asked_by}.\"{key}\": no key '{part}' that can vary; {nearest(part, known)}", asked_by)
            at = at[part]
        elif isinstance(at, list | tuple):
            if not part.isdigit() or int(part) >= len(at):
                there = f"0 … {len(at) - 1}" if at else "of an entry, of which there are none,"
                raise _fault(f"{asked_by}.\"{key}\": expected an index {there} instead of '{part}'", asked_by)
            at = at[int(part)]
        else:
            raise _fault(
                f"{asked_by}.\"{key}\": '{part}' is below a single value; expected {key[: -len(part) - 1]}", asked_by
            )
    return at


def _fault(what: str, asked_by: str) -> InputError:
    return InputError(what, asked_by.partition(",")[0])


def with_values(scenario: Scenario, values: Mapping[str, Any], asked_by: str) -> Scenario:
    """The scenario with some keys changed.

    Raises:
        InputError: A key does not exist or the value is not possible for it.
    """
    if not values:
        return scenario
    shown = ", ".join(f"{key} = {value}" for key, value in values.items())
    data = msgspec.to_builtins(scenario)
    for key, value in values.items():
        lookup(data, key, asked_by)
        *path, last = key.split(".")
        at: Any = data
        for part in path:
            if isinstance(at, dict):
                if isinstance(at[part], tuple):
                    at[part] = list(at[part])
                at = at[part]
            else:
                step = at[int(part)]
                if isinstance(step, tuple):
                    at[int(part)] = step = list(step)
                at = step
        at[int(last) if isinstance(at, list) else last] = value
    try:
        varied = msgspec.convert(data, Scenario)
    except msgspec.ValidationError as error:
        text = humane(str(error).partition(" - at ")[0])
        raise _fault(f"{asked_by}: {shown}: {text}", asked_by) from None
    possible(varied, lambda key, what: _fault(f"{asked_by}: {shown}: {key}: {what}", asked_by))
    return varied
