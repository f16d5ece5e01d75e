"""Cases of policies and their cards, commanded velocities, engines, rare falls, and of every command's own words."""

from __future__ import annotations

import contextlib
import copy
import random
import tempfile
import tomllib
from functools import cache
from pathlib import Path
from typing import Any

import tomli_w

from tests.fuzz.cases import ALONE, TINY, Case
from tests.fuzz.words import KEYS, NUMBERS, OTHERS, TEXTS, anything, plausible, quoted, scrambled, toml_of

ENGINES = ("mujoco", "home", "drake", "mujoco,home", "mujoco,nope", "", "Mujoco", "sap", "rigid")
ROBOTS = ("walker2d", "h1", "humanoid", "human3d", "human", "robot", "nope")
ODD: tuple[Any, ...] = (None, -1, 0, 1e300, True, "", "x", [], [1], [0.1] * 4, {}, {"a": 1}, "\x1b[31m", "[/nope]",
                        2**70)  # fmt: skip
RUNNING = ("certify", "check", "compare", "diff", "find", "run", "stability", "standard")
COMMANDS = (*RUNNING, "export", "list", "model", "new", "plot", "policy", "report", "video")
"""Those that carry out runs, and the others; not those that wait for somebody, or take minutes by themselves."""


@cache
def parts_of_policy() -> dict[str, bytes]:
    """A robot, a network and a card that work."""
    from tests.control.test_card import CARD, FLOOR, SERVOS, SIZE, network
    from tests.robot.test_recognise import model

    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        network(SIZE, 4)
        text = model(actuators=SERVOS, world=FLOOR)
        text = text.replace("<freejoint/>", '<freejoint/><site name="imu" pos="0.1 0 0.2" euler="0 20 0"/>', 1)
        card = tomli_w.dumps(CARD).encode()
        return {"net.onnx": Path("net.onnx").read_bytes(), "r.xml": text.encode(), "card.toml": card}


def _command(r: random.Random) -> dict[str, str]:
    """A table [command] of which something is wrong, or nothing."""
    wild = r.random() < 0.5
    names, numbers = ("forward", "left", "yaw"), ("0.3", "-0.2", "1e9", "0.0")
    table = {r.choice((*names, *(["nope"] if wild else []))): r.choice((*NUMBERS, anything(r)) if wild else numbers)}
    if r.random() < 0.5:
        piece = {"at": "0.01", "over": "0.01"}
        piece |= {r.choice(("at", "over", "forward", "yaw", "nope") if wild else names): r.choice(
            NUMBERS if wild else numbers) for _ in range(3)}  # fmt: skip
        table["piece"] = f"[{{ {', '.join(f'{key} = {value}' for key, value in piece.items())} }}]"
    return {"command": f"{{ {', '.join(f'{key} = {value}' for key, value in table.items())} }}"}


def card(r: random.Random) -> Case:
    """A policy's card, its network or its robot, of which something is wrong; run or checked."""
    files = dict(parts_of_policy())
    kind = r.random()
    if kind < 0.3:  # extreme, and none of it wrong
        data = tomllib.loads(files["card.toml"].decode())
        data["rate"], data["start"] = r.choice((25.0, 50.0, 1000.0)), r.choice((0.0, 0.02, 10.0))
        data["action"]["scale"] = r.choice((0.0, 0.3, 1e6, -50.0))
        data["default"] = [r.choice((0.1, -3.0, 1e5)) for _ in data["default"]]
        files["card.toml"] = tomli_w.dumps(data).encode()
    elif kind < 0.7:
        data = tomllib.loads(files["card.toml"].decode())
        for _ in range(r.choice((1, 1, 2))):
            at = data
            while True:
                key = r.choice(list(at)) if isinstance(at, dict) else r.randrange(len(at))
                if isinstance(at[key], dict | list) and at[key] and r.random() < 0.6:
                    at = at[key]
                    continue
                odd = r.choice(ODD)
                if odd is None and isinstance(at, dict):
                    del at[key]
                else:
                    at[key] = copy.deepcopy(odd if odd is not None else 0)
                break
            if not data:
                break
        files["card.toml"] = _toml(data)
    else:
        name = r.choice(sorted(files))
        files[name] = r.choice((b"", scrambled(r, files[name]), files[name][: r.randrange(len(files[name]))]))
    values = {"law": '"card.toml"', "duration": "0.05", "window.start": "0.0"}
    if r.random() < 0.5:
        values |= _command(r)
    run = ("run", "s.toml")
    argv = r.choice(((*run, *ALONE), (*run, "--trust", *ALONE), ("policy", "card.toml", "--trust")))
    return Case(argv, files | {"s.toml": toml_of(values).encode("utf-8", "replace")})


def _toml(data: dict[str, Any]) -> bytes:
    """A card in TOML; one of which TOML cannot hold something has no such line."""
    out = b""
    for key, value in data.items():
        with contextlib.suppress(Exception):
            out += tomli_w.dumps({key: value}).encode() if not isinstance(value, dict) else b""
    for key, value in data.items():
        with contextlib.suppress(Exception):
            out += tomli_w.dumps({key: value}).encode() if isinstance(value, dict) else b""
    return out


def commanded(r: random.Random) -> Case:
    """A velocity that is commanded of a policy, or of a law that knows none."""
    values = {"law": '"card.toml"', "duration": "0.05", "window.start": "0.0"} | _command(r)
    if r.random() < 0.2:
        values |= {"law": quoted(r.choice(("stand", "thesis", "nope"))), "model": quoted(r.choice(ROBOTS))}
    return Case(
        ("run", "s.toml", "--trust", *ALONE), parts_of_policy() | {"s.toml": toml_of(values).encode("utf-8", "replace")}
    )


def engine(r: random.Random) -> Case:
    """A robot in an engine that may not know it, with a few keys of the physics."""
    wild = r.random() < 0.4
    values = TINY | {"model": quoted(r.choice(ROBOTS if wild else ("walker2d", "h1", "human3d", "human")))}
    if values["model"] != '"human"' or r.random() < 0.6:
        values["law"] = quoted("stand")
    keys = [key for key in KEYS if key.startswith(("simulation.", "ground."))]
    for key in r.sample(keys, k=r.choice((0, 1, 2)) if wild else 0):
        values[key] = plausible(r, KEYS[key], TEXTS) if r.random() < 0.7 else anything(r)
    files = {"s.toml": toml_of(values).encode("utf-8", "replace")}
    name = r.choice(ENGINES if wild else ENGINES[:3])
    words = ("--engine", name) if r.random() < 0.7 else ("--set", f"engine={name}")
    return Case(("run", "s.toml", *words, *ALONE), files)


def certify(r: random.Random) -> Case:
    """How likely a fall is, of a tiny scenario and with numbers that cannot be."""
    values = TINY | {"start": '{ posture = "heel_toe", jitter = 0.01 }', "seed": "3"}
    if r.random() < 0.7:
        force = r.choice(("[40.0, 0.0]", "[1e9, 0.0]", anything(r)))
        table = {"force": force, "correlation": r.choice((*NUMBERS, "0.2"))}
        values["disturbance"] = f"{{ {', '.join(f'{key} = {value}' for key, value in table.items())} }}"
    options = {"--relative": (*NUMBERS, "0.5"), "--most": (*NUMBERS, "3", "0", "-1"),
               "--size": (*NUMBERS, "2", "0"), "--score": ("margin", "drop", "lean", "nope", ""),
               "--method": ("counting", "splitting", "nope")}  # fmt: skip
    good = {"--relative": ("0.5",), "--most": ("250",), "--size": ("20",), "--score": ("drop", "lean"),
            "--method": ("counting", "splitting")}  # fmt: skip
    from_these = options if r.random() < 0.5 else good
    words = [word for name in r.sample(sorted(options), k=2) for word in (name, r.choice(from_these[name]))]
    if "--most" not in words:
        words += ["--most", "250"]
    name = r.choice(("certify", "certify", "find"))
    if name == "find":
        words = ["--most", r.choice(("250", "250", "0", *NUMBERS)), "--failures", r.choice(("1", "1", "0", *NUMBERS))]
    return Case((name, "s.toml", *words, *ALONE), {"s.toml": toml_of(values).encode("utf-8", "replace")})


def typed(r: random.Random) -> Case:
    """Words after a command that it does not know, or knows otherwise."""
    pool = (*TEXTS, *NUMBERS, *OTHERS, "s.toml", "nope", "--nope", "--out", "--json", "--set", "-", "--", "--trust",
            "--engine", "seed=2", "controller=x")  # fmt: skip
    words = [r.choice(pool).replace("\x00", "") for _ in range(r.choice((0, 1, 2, 3)))]
    name = r.choice((*COMMANDS, "nope", ""))
    return Case((name, *words, *(ALONE if name in RUNNING else ())), {"s.toml": toml_of(TINY).encode()})


FAMILIES = (card, card, commanded, engine, certify, typed)
