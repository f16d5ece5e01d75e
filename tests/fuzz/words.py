"""Values that nobody means, as TOML text; and a writer of scenario files that does not mind them."""

from __future__ import annotations

import random
from collections.abc import Mapping, Sequence
from typing import Any, Literal, get_args, get_origin, get_type_hints

import msgspec

from biped.scenario.keys import Scenario

KNOWN = {
    "model": ("human",), "controller": ("normal", "fast", "robust", "tuned", "stop"),
    "start.posture": ("flat", "heel_toe", "single"), "push.body": ("torso", "left_shank", "right_foot"),
    "change.controller": ("normal", "robust"), "start.contacts": ("right_toe", "left_heel"),
}  # fmt: skip
"""Words that mean something, by key."""
NUMBERS = (
    "0", "-0.0", "1", "-1", "0.5", "2", "1e-3", "1e-9", "1e-300", "5e-324", "1e9", "1e15", "1.1e15", "-1e15", "1e300",
    "1.7976931348623157e308", "nan", "-nan", "inf", "-inf", "9223372036854775807", "9223372036854775808",
    "-9223372036854775808", "1" + "0" * 400, "9" * 5000, "0x" + "f" * 300, "0o7", "0b1", "1_000", "3.141592653589793",
    "44.99", "0.004", "0.001", "1000", "1e6", "-1e-3",
)  # fmt: skip
TEXTS = (
    "", " ", "human", "normal", "tuned", "robust", "flat", "heel_toe", "torso", "mujoco", "home", "touching", "[/nope]",
    "[bold]", "[link=x]y[/link]", "x" * 300, "x" * 5000, "../../etc/passwd", "/dev/zero", "/dev/null", "..", ".", "~",
    "s.toml", "g.toml", "m.xml", "s", "nan", "null", "ünïcödé", "日本語", "a b", "a.b", "'", '"', "\\",
    "\x1b[31m\x1b]0;x\x07", "\x00", "\u2028", "\u202e", "\U0001f9bf", "%s%n", "{0}", "$(id)", "l.py:Law", "-", "--",
    "\n",
)  # fmt: skip
OTHERS = (
    "true", "false", "[]", "{}", "[[]]", "[1, 2]", "[1, 'a', true, {}]", "{ a = 1 }", "1979-05-27", "07:32:00",
    "1979-05-27T07:32:00Z", "[" * 200 + "]" * 200, "[" * 20 + "]" * 20, "[" + "1, " * 2000 + "]", "{ min = 1 }",
    "{ uniform = [0, 1] }", "[{}]", "[{ at = 0.01 }]",
)  # fmt: skip


def quoted(text: str) -> str:
    """A text as a basic TOML string."""
    plain = {c for c in text if c.isprintable() and c not in '"\\'}
    out = "".join(c if c in plain else f"\\U{ord(c):08x}" for c in text)
    return f'"{out}"'


def anything(r: random.Random) -> str:
    """Any value at all."""
    kind = r.random()
    if kind < 0.5:
        return r.choice(NUMBERS)
    if kind < 0.75:
        return quoted(r.choice(TEXTS))
    return r.choice(OTHERS)


def keys() -> dict[str, Any]:
    """Every dotted key of a scenario and its type; lists of tables end in `.0`."""
    out: dict[str, Any] = {}

    def add(at: str, kind: type) -> None:
        for name, hint in get_type_hints(kind, include_extras=True).items():
            record = _record(hint)
            if record is None:
                out[at + name] = hint
            elif record.__name__ not in ("Tune", "Distribution", "Bound"):
                add(f"{at}{name}.", record)

    add("", Scenario)
    return out


def _record(hint: Any) -> type | None:
    for kind in _kinds(hint):
        if isinstance(kind, type) and issubclass(kind, msgspec.Struct):
            return kind
    return None


def _kinds(hint: Any) -> list[Any]:
    """A type and the types that it is made of, two levels deep."""
    return [hint, *get_args(hint), *(inner for part in get_args(hint) for inner in get_args(part))]


KEYS = keys()


def plausible(r: random.Random, hint: Any, words: Sequence[str] = TEXTS) -> str:
    """A value of the right type, within its bounds, of any size; or one of the words."""
    bounds = [meta for part in (hint, *get_args(hint)) for meta in get_args(part)[1:] if isinstance(meta, msgspec.Meta)]
    kinds = _kinds(hint)
    for kind in kinds:
        if get_origin(kind) is Literal:
            return quoted(r.choice(get_args(kind)))
        if get_origin(kind) is tuple:
            parts = get_args(kind)
            size = len(parts) if parts[-1] is not Ellipsis else next((b.min_length for b in bounds if b.min_length), 2)
            return "[" + ", ".join(plausible(r, parts[0], words) for _ in range(size or 2)) + "]"
    if bool in kinds:
        return r.choice(("true", "false"))
    if int in kinds:
        return str(int(10 ** r.uniform(0, 4)))
    if float in kinds:
        low = next((b.ge if b.ge is not None else b.gt for b in bounds if b.ge is not None or b.gt is not None), -1e15)
        high = next((b.le if b.le is not None else b.lt for b in bounds if b.le is not None or b.lt is not None), 1e15)
        size = 10 ** r.uniform(-12, 15) if r.random() < 0.3 else 10 ** r.uniform(-3, 1)
        value = min(max(size * r.choice((1, 1, 1, -1)), low), high)
        return repr(float(r.choice((low, high, *(value,) * 8))))
    return quoted(r.choice(words))


def toml_of(values: Mapping[str, str]) -> str:
    """Values by dotted key, as text, in a TOML file."""
    return "".join(f"{key} = {value}\n" for key, value in values.items())


def scrambled(r: random.Random, text: bytes) -> bytes:
    """The text with some of its bytes changed, lost, doubled or in another place."""
    out = bytearray(text)
    for _ in range(r.choice((1, 1, 2, 5, 20))):
        at, size = r.randrange(len(out) + 1), r.choice((1, 1, 2, 8, 40))
        match r.randrange(5):
            case 0:
                out[at : at + size] = bytes(r.randrange(256) for _ in range(size))
            case 1:
                del out[at : at + size]
            case 2:
                out[at:at] = out[at : at + size] * r.choice((1, 2, 50))
            case 3:
                out[at:at] = r.choice((b"[", b"]", b"=", b'"', b"\n", b".", b"\x00", b"\xff", b"nan", b"1e999", b"\r"))
            case _:
                other = r.randrange(len(out) + 1)
                out[other:other] = out[at : at + size]
    return bytes(out)
