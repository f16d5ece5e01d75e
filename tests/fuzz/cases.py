"""Case n of the fuzzer: files and a command line, made from its number alone."""

from __future__ import annotations

import json
import random
import re
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from tests.fuzz.words import KEYS, KNOWN, NUMBERS, OTHERS, TEXTS, anything, plausible, quoted, scrambled, toml_of

ROOT = Path(__file__).parents[2]
HUMAN = (ROOT / "models" / "human.xml").read_bytes()
GAITS = [path.read_bytes() for path in sorted((ROOT / "controllers").glob("*.toml"))]
SCENARIOS = [path.read_bytes() for path in sorted((ROOT / "scenarios").rglob("*.toml"))]
TINY = {"duration": "0.03", "window.start": "0.0"}
SHORT = ("--set", "duration=0.03", "--set", "window={start=0.0,end=0.03}", "--set", "randomise.runs=2")

ALONE = ("--jobs", "1")
"""In this process, where the harness sees what happens."""


class Case(NamedTuple):
    """What a user of bad luck or bad will has.

    Attributes:
        argv: The command line.
        files: Files in the working folder, by name.
    """

    argv: tuple[str, ...]
    files: dict[str, bytes]


def _values(r: random.Random, hostile: float) -> dict[str, str]:
    """Some keys of a scenario, each with a value that is hostile or only extreme."""
    values: dict[str, str] = {"engine": quoted(r.choice(("mujoco", "mujoco", "home")))}
    for _ in range(r.choice((1, 1, 2, 3, 6))):
        key = r.choice([key for key in KEYS if key != "law" or r.random() < 0.1])
        if key.startswith(("push.", "change.")):
            values |= _table(r, key.partition(".")[0], hostile)
        elif key == "sweep":
            values["sweep"] = _variation(r, lambda: f"[{_value(r, 'ground.slope', hostile)}, {anything(r)}]")
        else:
            values[key] = _value(r, key, hostile)
    if r.random() < 0.2:
        kinds = (
            lambda: f"{{ uniform = [{r.choice(NUMBERS)}, {r.choice(NUMBERS)}] }}",
            lambda: f"{{ normal = [{r.choice(NUMBERS)}, {r.choice(NUMBERS)}] }}",
            lambda: f"{{ grid = [{anything(r)}, {anything(r)}] }}",
            lambda: f"{{ choice = [{anything(r)}] }}",
        )
        values["randomise.draw"] = _variation(r, r.choice(kinds))
        values["randomise.runs"] = "3"
    if r.random() < 0.1:
        values["expect"] = f"{{ {r.choice(('speed', 'falls', 'nope', 'walked'))} = {{ min = {anything(r)} }} }}"
    values = TINY | values
    if r.random() < 0.05:
        values["extends"] = quoted(r.choice((*TEXTS, "level_normal", "robust/own")))
    return values


def _value(r: random.Random, key: str, hostile: float) -> str:
    if r.random() < hostile:
        return anything(r)
    return plausible(r, KEYS[key], KNOWN.get(key, TEXTS) if r.random() < 0.9 else TEXTS)


def _table(r: random.Random, name: str, hostile: float) -> dict[str, str]:
    keys = [key for key in KEYS if key.startswith(f"{name}.")]
    chosen = {"at": "0.01", "duration": "0.01", "force": "[100.0, 0.0]"} if name == "push" else {"at": "0.01"}
    for key in r.sample(keys, k=r.choice((1, 2))):
        chosen[key.partition(".")[2]] = _value(r, key, hostile)
    inside = ", ".join(f"{key} = {value}" for key, value in chosen.items())
    return {name: f"[{{ {inside} }}]"}


def _variation(r: random.Random, value: Callable[[], str]) -> str:
    known = [re.sub(r"^(push|change)\.", r"\1.0.", key) for key in KEYS]
    odd = ("", "push.0.force.0", "truth.mass.3", "a.b", "ground", "x" * 300)
    keys = r.choices((*known, *known, *odd), k=r.choice((1, 1, 2)))
    return "{ " + ", ".join(f"{quoted(key)} = {value()}" for key in dict.fromkeys(keys)) + " }"


def scenario(r: random.Random) -> Case:
    """A scenario of which some values are wrong."""
    text = toml_of(_values(r, r.choice((0.0, 0.0, 0.0, 0.3, 1.0)))).encode("utf-8", "replace")
    if r.random() < 0.15:
        text = scrambled(r, text)
    return Case((r.choice(("run", "run", "run", "check")), "s.toml", *ALONE), {"s.toml": text})


def shipped(r: random.Random) -> Case:
    """A shipped scenario with a few bytes changed, made short."""
    return Case(("run", "s.toml", *SHORT, *ALONE), {"s.toml": scrambled(r, r.choice(SCENARIOS))})


def change(r: random.Random) -> Case:
    """A hostile command line."""
    words: list[str] = []
    for _ in range(r.choice((1, 2))):
        key = r.choice((*KEYS, *KEYS, "", ".", "a." * 100 + "a", "ground", "push.0.at", "[x]", "=", "x" * 300))
        odd = (r.choice(TEXTS), r.choice(OTHERS), "", "=" * 20, "1\nseed=2", "1 # x", "'", '"""')
        value = r.choice((anything(r), *odd))
        words += ["--set", r.choice((f"{key}={value}", f"{key}={value}", key, value))]
    if r.random() < 0.3:
        words += [r.choice(("--only", "--out", "--engine", "--nope", "-x")), r.choice((*TEXTS, *NUMBERS))]
    words = [word.replace("\x00", "") for word in words]  # no command line can hold one
    return Case(("run", "s.toml", *words, *ALONE), {"s.toml": toml_of(TINY).encode()})


def gait(r: random.Random) -> Case:
    """A gait file of which something is wrong."""
    text = r.choice(GAITS)
    if r.random() < 0.5:
        text = scrambled(r, text)
    else:
        keys = ("k_d1", "k_d2", "b_d3", "theta_b", "theta_l", "speeds", "sensing", "actuation", "sensing.heel_on",
                "actuation.mode", "description", "source", "extends", "nope", "speed")  # fmt: skip
        text = b"extends = 'normal'\n" + toml_of({r.choice(keys): anything(r) for _ in range(2)}).encode()
    values = TINY | {"controller": '"g.toml"'}
    if r.random() < 0.2:
        values["gains.speed"] = r.choice(NUMBERS)
    return Case(("run", "s.toml", *ALONE), {"s.toml": toml_of(values).encode(), "g.toml": text})


def model(r: random.Random) -> Case:
    """A model file of which numbers, names or bytes are wrong."""
    text = HUMAN
    kind = r.random()
    if kind < 0.5:
        found = list(re.finditer(rb"-?\d+\.?\d*", text))
        for number in sorted(r.sample(found, k=r.choice((1, 1, 3))), key=lambda match: -match.start()):
            value = r.choice((*NUMBERS, "0.1", "-0.5", "10")).encode()
            text = text[: number.start()] + value + text[number.end() :]
    elif kind < 0.8:
        found = list(re.finditer(rb'"[a-z_]+"', text))
        one, other = r.choice(found), r.choice(found)
        text = text[: one.start()] + other[0] + text[one.end() :]
    else:
        text = scrambled(r, text)
    values = TINY | {"model": '"m.xml"', "engine": quoted(r.choice(("mujoco", "home")))}
    return Case(("run", "s.toml", *ALONE), {"s.toml": toml_of(values).encode(), "m.xml": text})


def results(r: random.Random) -> Case:
    """A results folder that is damaged, looked at."""
    files = dict(made())
    name = r.choice(("result.json", *sorted(files)))
    match r.randrange(4):
        case 0:
            files.pop(name)
        case 1:
            whole = (b"", b"{}", b"[]", b"null", b"1", b'"x"', b'{"runs": []}', b"\xff\xfe", b"[" * 9000)
            files[name] = r.choice(whole)
        case 2:
            files[name] = files[name][: r.randrange(len(files[name]))]
        case _:
            files[name] = _altered(r, files[name]) if name == "result.json" else scrambled(r, files[name])
    title = r.choice(TEXTS).replace("\x00", "")
    argv = r.choice((("plot", "x"), ("report", "x"), ("report", "x", "x", "--title", title)))
    return Case(argv, {f"x/{name}": data for name, data in files.items()})


def journal(r: random.Random) -> Case:
    """An interrupted campaign whose journal is damaged, continued."""
    files = {name: data for name, data in made(runs=3).items() if name in ("scenario.toml", "runs.jsonl")}
    lines = files["runs.jsonl"].splitlines(keepends=True)
    lines = lines[: r.randrange(len(lines) + 1)]
    bad = (b"\n", b"{}\n", b"null\n", b"[]\n", b"1\n", b"\x00" * 40 + b"\n", b"\xff\xfe\n", b"{", b'{"index": 0}\n',
           "\u2028\n".encode(), b"nan\n", b'{"index": 99}\n', b'{"index": "0"}\n', b"[" * 9000 + b"\n")  # fmt: skip
    for _ in range(r.choice((1, 1, 3))):
        lines.insert(r.randrange(len(lines) + 1), r.choice((*bad, *(scrambled(r, line) for line in lines))))
    files["runs.jsonl"] = b"".join(lines)
    argv = ("run", "x/scenario.toml", "--out", "x", *ALONE)
    return Case(argv, {f"x/{name}": data for name, data in files.items()})


def _altered(r: random.Random, text: bytes) -> bytes:
    """A result with one of its values replaced or removed."""
    data = json.loads(text)
    at = data
    while True:
        key = r.choice(list(at)) if isinstance(at, dict) else r.randrange(len(at))
        inner = at[key]
        if isinstance(inner, dict | list) and inner and r.random() < 0.8:
            at = inner
            continue
        if isinstance(at, dict) and r.random() < 0.4:
            del at[key]
        else:
            at[key] = r.choice((None, {}, [], "x", -1, 1e300, True, "\x1b[31m", "[/nope]", [[]], {"a": 1}))
        return json.dumps(data).encode()


_made: dict[int, dict[str, bytes]] = {}


def made(runs: int = 1) -> dict[str, bytes]:
    """The files of a good results folder, made once."""
    if runs not in _made:
        import contextlib
        import io
        import tempfile

        from biped.cli.main import main

        with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stdout(io.StringIO()):
            where = Path(folder) / "x"
            changes = ["--set", f"randomise.runs={runs}", "--set", "start.jitter=0.001", *ALONE]
            code = main(["run", "level_normal", *SHORT[:4], *changes, "--out", str(where)])
            assert code in (0, 1, 3)
            _made[runs] = {str(p.relative_to(where)): p.read_bytes() for p in where.rglob("*") if p.is_file()}
    return _made[runs]


KINDS = (
    *[scenario] * 8, *[shipped] * 2, *[change] * 4, *[gait] * 3, *[model] * 3, *[journal] * 2, *[results] * 1,
)  # fmt: skip


def case(seed: int, number: int) -> tuple[str, Case]:
    """Case `number` and the name of its kind."""
    from tests.fuzz.families import FAMILIES

    r = random.Random(f"{seed}-{number}")
    kinds = (*KINDS, *FAMILIES)
    kind = kinds[number % len(kinds)]
    return kind.__name__, kind(r)
