"""What a scenario or gait file may say: known keys, right types, finite numbers, possible values."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from types import UnionType
from typing import Any, get_args, get_origin, get_type_hints

import msgspec

from biped.base.errors import InputError
from biped.base.files import nearest
from biped.base.text import echo, said
from biped.scenario.keys import Bound, Change, Distribution, Push, Scenario
from biped.scenario.laws import own_law
from biped.scenario.metrics import METRICS
from biped.scenario.pushing import MOST_PIECES, PIECE, count
from biped.scenario.robot import Foot
from biped.scenario.truth import Part

MOST_STEPS = 100_000_000
"""Physics steps of the longest run: a day at 1 kHz."""
MOST_TICKS = 10_000_000
"""Control ticks of the longest run: each is a row of the trajectory, in memory."""
MOST_RUNS = 1_000_000
"""Of a campaign: points of its sweep times runs of each."""
MOST_DELAY = 100_000
"""Control ticks that sensors may lag behind: each is kept."""
MOST_VALUES = 100_000
"""That a standard test may tell apart."""
MOST_DIGITS = 2**63
"""Beyond it lies no whole number that a file can mean."""

LISTS: dict[str, type] = {"push": Push, "change": Change, "foot": Foot, "part": Part}
"""Lists of tables, and what each of their tables is."""

Fail = Callable[[str, str], InputError]
"""From a dotted key and what is wrong with it to the error, which names the file that the key comes from."""


def convert(data: Any, kind: type, fail: Fail) -> Any:
    """Converts plain data to a typed record, turning the library's complaint into ours."""
    try:
        return msgspec.convert(data, kind)
    except msgspec.ValidationError as error:
        text, _, place = str(error).partition(" - at `$")
        key = place.rstrip("`").lstrip(".")
        raise fail(key or kind.__name__.lower(), humane(text) + _got(data, key, text)) from None


def _got(data: Any, key: str, text: str) -> str:
    """The offending value, where the library's complaint does not say what it got."""
    if "got" in text or "missing" in text or "..." in key:
        return ""
    for part in re.findall(r"\w+", key):
        data = data[int(part)] if part.isdigit() else data[part]
    return f", got {echo(data)}"


def humane(text: str) -> str:
    """A complaint of the library in a user's words."""
    words = {"Object missing required field ": "missing key ", "`float | array`": "a number or a list",
             "`bool | float | str`": "a number, a string, true or false",
             "`float`": "a number", "`int`": "a whole number", "`str`": "a string", "`object`": "a table",
             "`array`": "a list", "`bool`": "true or false", "got `null`": "got nothing"}  # fmt: skip
    text = text.replace(" | null`", "`")  # TOML has no null
    for word, ours in words.items():
        text = text.replace(word, ours)
    text = re.sub(r"-?\d{6,}(\.0)?", lambda number: f"{float(number[0]):g}", text)
    return text[0].lower() + text[1:]


def known_keys(data: Any, kind: type, at: str, fail: Fail) -> None:
    """Rejects keys that no field has, and numbers that are not finite, with the nearest valid name."""
    hints = get_type_hints(kind)
    for key, value in data.items():
        dotted = f"{at}{key}"
        if key not in hints:
            raise fail(said(dotted), f"unknown key; {nearest(key, sorted(hints))}")
        _finite(value, dotted, fail)
        if key in ("draw", "sweep") and isinstance(value, dict):
            _variations(value, dotted, fail)
        elif key in ("expect", "thesis") and isinstance(value, dict):
            _metrics(value, key, fail)
        elif key in LISTS:
            if not isinstance(value, list) or not all(isinstance(table, dict) for table in value):
                raise fail(dotted, f"expected a list of tables, each headed [[{dotted}]]")
            for i, table in enumerate(value):
                known_keys(table, LISTS[key], f"{dotted}[{i}].", fail)
        elif isinstance(value, dict) and (record := _record(hints[key])) is not None:
            known_keys(value, record, f"{dotted}.", fail)
        elif isinstance(value, dict) and (named := _named_records(hints[key])) is not None:
            for name, inner in value.items():
                _table(inner, named, f"{dotted}.{name}", "{ }", fail)
        elif isinstance(value, str) and (choices := _choices(hints[key])) and value not in choices:
            raise fail(dotted, f"expected one of {', '.join(choices)}, got '{said(value)}'; {nearest(value, choices)}")


def _metrics(value: dict, key: str, fail: Fail) -> None:
    """Checks [expect] or [thesis]: names of metrics, and bounds or numbers."""
    for name, inner in value.items():
        dotted = f"{key}.{name}"
        if name not in METRICS:
            raise fail(said(dotted), f"unknown metric; {nearest(name, list(METRICS))}")
        if key == "thesis":
            _finite(inner, dotted, fail)
            if isinstance(inner, bool) or not isinstance(inner, int | float):
                raise fail(dotted, f"expected a number, got {echo(inner)}")
        else:
            _table(inner, Bound, dotted, "{ min = 0.7, max = 1.0 }", fail)


def _variations(value: dict, at: str, fail: Fail) -> None:
    """Checks [randomise.draw] or [sweep]; that their keys exist is for `biped.scenario.vary`."""
    for key, inner in value.items():
        dotted = said(f'{at}."{key}"')
        if isinstance(inner, dict) and (at == "sweep" or any(isinstance(one, dict) for one in inner.values())):
            raise fail(
                said(f"{at}.{key}"),
                f'expected the dotted key of what varies in quotes, such as {at}."ground.slope"',
            )
        if at == "sweep":
            _finite(inner, dotted, fail)
            if not isinstance(inner, list) or any(isinstance(one, list | dict) for one in inner):
                raise fail(dotted, f"expected a list of numbers or words, got {echo(inner)}")
        else:
            _table(inner, Distribution, dotted, "{ uniform = [0.5, 1.0] }", fail)


def _table(value: Any, kind: type, at: str, example: str, fail: Fail) -> None:
    if not isinstance(value, dict):
        raise fail(at, f"expected a table such as {example}, got {echo(value)}")
    known_keys(value, kind, f"{at}.", fail)
    convert(value, kind, lambda inside, what: fail(f"{at}.{inside}", what))


def _record(hint: Any) -> type | None:
    """The record that a field holds, if it holds one, perhaps optionally."""
    kinds = [kind for kind in (hint, *get_args(hint)) if isinstance(kind, type) and issubclass(kind, msgspec.Struct)]
    return kinds[0] if kinds and get_origin(hint) in (None, UnionType) else None


def _named_records(hint: Any) -> type | None:
    """The records that a table of freely named records holds."""
    return _record(get_args(hint)[1]) if get_origin(hint) is dict else None


def _choices(hint: Any) -> list[str]:
    return [choice for part in (hint, *get_args(hint)) for choice in get_args(part) if isinstance(choice, str)]


def _finite(value: Any, key: str, fail: Fail) -> None:
    if isinstance(value, float) and not math.isfinite(value):
        raise fail(key, f"expected a finite number, got {value}")
    if isinstance(value, int) and not -MOST_DIGITS <= value < MOST_DIGITS:
        raise fail(key, f"expected a number of fewer digits, got {echo(value)}")
    if isinstance(value, dict):
        for name, inner in value.items():
            _finite(inner, f"{key}.{said(name)}", fail)
    if isinstance(value, list):
        for i, inner in enumerate(value):
            _finite(inner, f"{key}[{i}]", fail)


def possible(s: Scenario, fail: Fail) -> None:
    """Rejects what types cannot: times outside the run, contradictory bounds, more than a machine holds."""
    most = min(MOST_TICKS / s.simulation.control_rate, MOST_STEPS * s.simulation.timestep)
    if s.duration > most:
        raise fail("duration", f"expected at most {most:g} s at this time step and control rate, got {s.duration:g}")
    if s.duration * s.simulation.control_rate < 1.0:
        raise fail("duration", f"expected at least one control tick of {1.0 / s.simulation.control_rate:g} s, got "
                   f"{s.duration:g}")  # fmt: skip
    if s.sensors.delay * s.simulation.control_rate > MOST_DELAY:
        raise fail("sensors.delay", f"expected at most {MOST_DELAY / s.simulation.control_rate:g} s at this control "
                   f"rate, got {s.sensors.delay:g}")  # fmt: skip
    for i, push in enumerate(s.push):
        if push.at >= s.duration:
            raise fail(f"push[{i}].at", f"expected a time within the run (duration {s.duration} s), got {push.at}")
    _changing_pushes(s, fail)
    _follow_one_another(s, fail)
    _ramps(s, fail)
    _seat(s, fail)
    start, end = s.interval
    for key, given in (("window.start", s.window.start), ("window.end", s.window.end)):
        if given is not None and given > s.duration:
            raise fail(key, f"expected a time within the run (duration {s.duration} s), got {given}")
    if end <= start:
        raise fail("window", f"expected start < end, got [{start}, {end}] s")
    if s.duration < 2 * s.simulation.timestep:
        raise fail("duration", f"expected at least two time steps of {s.simulation.timestep} s, got {s.duration}")
    steps = 1.0 / (s.simulation.control_rate * s.simulation.timestep)
    if round(steps) < 1 or abs(steps - round(steps)) > 1e-6 * steps:
        raise fail(
            "simulation.control_rate",
            f"expected 1/control_rate to be a whole number of time steps of {s.simulation.timestep} s, "
            f"got {steps:g} steps",
        )
    if s.actuation.null_torque is not None and s.actuation.mode != "joint":
        raise fail("actuation.null_torque", "expected mode = 'joint': generalized forces leave nothing free")
    if s.actuation.motors and s.actuation.mode != "joint":
        raise fail("actuation.motors", "expected mode = 'joint': generalized forces come from no motor")
    if own_law(s.law) and s.actuation.mode != "joint":
        raise fail("actuation.mode", f"expected 'joint' with a law of one's own, which returns torques; got "
                   f"'{s.actuation.mode}'")  # fmt: skip
    if own_law(s.law) and s.backstep is not None:
        raise fail("backstep", "expected no law of one's own: the step back belongs to the thesis's leg states")
    _sensed(s, fail)
    _searched(s, fail)
    for name, bound in s.expect.items():
        if bound.min is None and bound.max is None:
            raise fail(f"expect.{name}", "expected min, max or both")
        if bound.min is not None and bound.max is not None and bound.min > bound.max:
            raise fail(f"expect.{name}", f"expected min <= max, got {bound.min} > {bound.max}")
    for key, distribution in s.randomise.draw.items():
        given = [name for name in distribution.__struct_fields__ if getattr(distribution, name) is not None]
        if len(given) != 1:
            raise fail(f'randomise.draw."{key}"', f"expected exactly one of normal, uniform, choice, grid, got {given}")
        if distribution.uniform is not None and distribution.uniform[0] > distribution.uniform[1]:
            raise fail(f'randomise.draw."{key}".uniform', f"expected lower <= upper, got {list(distribution.uniform)}")
        if distribution.choice == () or distribution.grid == ():
            raise fail(f'randomise.draw."{key}"', "expected at least one value")
    if len(s.sweep) > 2:
        raise fail("sweep", f"expected one or two keys, got {len(s.sweep)}")
    for key, values in s.sweep.items():
        if not values:
            raise fail(f'sweep."{key}"', "expected at least one value")
        if key in s.randomise.draw:
            raise fail(f'sweep."{key}"', "expected a key that is not drawn at random as well")
    runs = s.randomise.runs * math.prod(map(len, s.sweep.values()))
    if runs > MOST_RUNS:
        raise fail("sweep", f"expected at most {MOST_RUNS} runs in all (randomise.runs at each point), got {runs}")
    # MuJoCo would take two steps instead, without a word. The home engine's contacts are rigid.
    if s.engine == "mujoco" and s.ground.contact_time < 2 * s.simulation.timestep * (1.0 - 1e-9):
        raise fail("ground.contact_time", f"expected at least two time steps ({2 * s.simulation.timestep:g} s), "
                   f"got {s.ground.contact_time:g}")  # fmt: skip


def _sensed(s: Scenario, fail: Fail) -> None:
    """Rejects an estimator without its sensors, sensors without it, and noise on what nobody measures."""
    if s.robot is not None:
        return  # its gyro is read as it is, and what it has not is refused by name
    for key, there in (("sensors.zero_error", s.sensors.zero_error > 0.0), ("truth.part", s.truth.part)):
        if there:
            raise fail(key, f"belongs to robots of any kind (docs/robots.md), which model '{s.model}' is not here")
    names = ("encoders", "gyro", "switches")
    there = [name for name in names if getattr(s.sensors, name) is not None]
    if s.estimator is None:
        if there:
            raise fail(f"sensors.{there[0]}", "expected an [estimator], which infers the posture from it")
        return
    if missing := [name for name in names if name not in there]:
        raise fail("estimator", f"expected sensors to infer from: [sensors.{missing[0]}] is missing")
    direct = ("angle_noise", "rate_noise", "height_noise", "delay", "quantisation")
    if told := [name for name in direct if getattr(s.sensors, name) > 0.0]:
        raise fail(f"sensors.{told[0]}", "expected none with an [estimator]: nobody measures the posture itself")
    switches = s.sensors.switches
    if switches is not None and switches.release > switches.force:
        raise fail("sensors.switches.release", f"expected at most the force that closes a switch, {switches.force:g} "
                   f"N, got {switches.release:g}")  # fmt: skip


def _searched(s: Scenario, fail: Fail) -> None:
    """Rejects a [standard] that cannot be searched, or shows what there is not."""
    if s.standard is None:
        return
    test = s.standard
    for name in test.shows:
        if name not in METRICS:
            raise fail("standard.shows", f"unknown metric '{said(name)}'; {nearest(name, list(METRICS))}")
    if test.key is None:
        return
    if test.step == 0.0 or (test.last - test.first) * test.step < 0.0:
        raise fail("standard.step", f"expected steps from first = {test.first:g} to last = {test.last:g}, got "
                   f"{test.step:g}")  # fmt: skip
    parts = abs(test.step) / test.resolution
    if round(parts) < 1 or abs(parts - round(parts)) > 1e-6 * parts:
        raise fail("standard.resolution", f"expected the step of {test.step:g} to be a whole number of them, got "
                   f"{test.resolution:g}")  # fmt: skip
    if abs(test.last - test.first) / test.resolution > MOST_VALUES:
        raise fail("standard.resolution", f"expected at most {MOST_VALUES} of them from first to last, got "
                   f"{test.resolution:g}")  # fmt: skip


def _changing_pushes(s: Scenario, fail: Fail) -> None:
    """Rejects pushes in more pieces than a run is kept with."""
    tick, total = 1.0 / s.simulation.control_rate, 0
    for i, push in enumerate(s.push):
        if push.shape != "constant":
            total += count(push, tick, s.duration)
            if total > MOST_PIECES:
                raise fail(
                    f"push[{i}].duration",
                    f"expected at most {MOST_PIECES} pieces of pushes that change, {PIECE:g} s each, of a sine at most "
                    f"a 20th of its period; got {total}",
                )


def _ramps(s: Scenario, fail: Fail) -> None:
    """Rejects tiles and steps that are shorter than the ramps between them."""
    tiles, steps = s.ground.tiles, s.ground.steps
    for key, there, length, ramp in (
        ("ground.tiles.length", tiles.height > 0.0, tiles.length, tiles.ramp),
        ("ground.steps.run", steps.rise != 0.0, steps.run, steps.ramp),
    ):
        if there and length <= ramp:
            raise fail(key, f"expected more than the ramp of {ramp:g} m, got {length:g}")


def _seat(s: Scenario, fail: Fail) -> None:
    """Rejects a seat where nothing could sit on it."""
    if s.ground.seat.height > 0.0 and s.engine == "home":
        raise fail("ground.seat.height", "expected 0: at home nothing but toes and heels meets anything; a seat needs "
                   "engine = 'mujoco'")  # fmt: skip


def _follow_one_another(s: Scenario, fail: Fail) -> None:
    """Rejects changes outside the run, before the end of the last, or of a law that has no gains."""
    if s.change and own_law(s.law):
        raise fail("change", "expected no law of one's own, which knows the time; changes are the thesis's law's")
    free = 0.0
    for i, change in enumerate(s.change):
        if change.at >= s.duration:
            raise fail(f"change[{i}].at", f"expected a time within the run (duration {s.duration} s), got {change.at}")
        if change.at < free:
            raise fail(f"change[{i}].at", f"expected at least {free:g} s, where the one before ends, got {change.at:g}")
        free = change.at + change.over
        told = [key for key in change.actuation.__struct_fields__ if getattr(change.actuation, key) is not None]
        if told and s.actuation.contacts == "pushing":
            raise fail(f"change[{i}].actuation.{told[0]}", "expected none where actuation.contacts = 'pushing': joint "
                       "torques for ground that only pushes choose no contacts")  # fmt: skip
