"""Which keys robots of any kind take notice of, by law; a scenario that says any other is refused, by name."""

from collections.abc import Iterator
from typing import Any, NamedTuple

from biped.base.text import echo, safe
from biped.scenario.engines import ENGINES
from biped.scenario.keys import Scenario
from biped.scenario.laws import BUILT_IN, SPATIAL, Keys, is_card
from biped.scenario.valid import Fail

ALL: Keys = {
    "start": ("posture", "settle", "jitter", "upright"),
    "ground": ("slope", "side_slope", "tiles", "steps", "friction", "contact_time", "damping_ratio"),
    "actuation": ("torque_limit", "lag", "delay", "delay_jitter"),
    "sensing": (),
    "sensors": ("angle_noise", "rate_noise", "height_noise", "delay", "quantisation", "zero_error", "gyro"),
    "truth": (
        "joint_damping", "part", "strength", "servo_stiffness", "servo_damping", "joint_friction", "joint_losses",
        "armature", "unmodelled",
    ),
    "randomise": ("runs", "masses", "draw", "moves"),
}  # fmt: skip
"""Whatever the law is. Tables that are not named here are read whole."""
CARD: Keys = {"": ("command",)}
"""Keys that a policy's card reads besides."""
OWN: Keys = {"": ("controller", "gains", "command"), "ground": ("angles",)}
"""Keys that a law of one's own is handed besides (`biped.control.law.Setup`)."""
SPLIT = ("Euler", "implicit", "implicitfast")
"""MuJoCo's integrators whose step has two halves, between which a law ticks and contacts change."""
_ASKED = ("controller", "reading", "gains", "change", "backstep", "estimator", "command")
"""Keys of the scenario itself that only some laws read."""


class _Vain(NamedTuple):
    """A key that is said in vain: its table, its name, its default."""

    table: str
    key: str
    default: Any

    @property
    def dotted(self) -> str:
        return f"{self.table}.{self.key}".lstrip(".")


def read_by(law: str | None) -> dict[str, tuple[str, ...]]:
    """Keys that are read under a law, by table; "" is the scenario itself."""
    besides = BUILT_IN[law].reads if law in BUILT_IN else CARD if is_card(law) else OWN
    return {table: (*ALL.get(table, ()), *besides.get(table, ())) for table in ("", *ALL)}


def noticed_of(habits: dict[str, Any], law: Any) -> dict[str, Any]:
    """Returns the habits in a model's description, without keys that the law takes no notice of.

    Args:
        habits: As plain data.
        law: The scenario's, as it was written.
    """
    read = read_by(law if isinstance(law, str) else None)
    out = {key: value for key, value in habits.items() if key not in _ASKED or key in read[""]}
    for table in ALL:
        if isinstance(out.get(table), dict):
            out[table] = {key: value for key, value in out[table].items() if key in read[table]}
    return out


def taken(s: Scenario, fail: Fail) -> None:
    """Rejects what a scenario of a robot of any kind says in vain, by name: its law would take no notice of it."""
    if not ENGINES[s.engine].any_robot:
        others = " or ".join(f"'{name}'" for name, engine in ENGINES.items() if engine.any_robot)
        raise fail("engine", f"expected {others}: '{s.engine}' has seven links; got '{s.engine}'")
    if s.truth.unmodelled.patchy and s.simulation.integrator not in SPLIT:
        raise fail("simulation.integrator", f"expected one of {', '.join(SPLIT)}: within a step of "
                   f"'{s.simulation.integrator}' no contact can be changed, as truth.unmodelled asks for")  # fmt: skip
    if s.gains.speed is not None and not s.controller:
        raise fail("gains.speed", "expected none: no controller is named, and it is the speed of one that is a family")
    read = read_by(s.law)
    if vain := list(_in_vain(s, read)):
        first, *others = vain
        who = f"law '{s.law}'" if s.law in BUILT_IN else "a policy's card" if is_card(s.law) else "a law of one's own"
        nor = f", nor of {safe(', '.join(one.dotted for one in others))}" if others else ""
        reads = (
            f"; of [{first.table}] it reads {', '.join(read[first.table]) or 'nothing'}" if first.table in ALL else ""
        )
        raise fail(first.dotted, f"expected {_written(first.default)}: {who} takes no notice of it on a robot of any "
                   f"kind{nor}{reads}")  # fmt: skip
    if s.law == SPATIAL and s.actuation.mode == "joint" and s.actuation.contacts != "pushing":
        raise fail("actuation.contacts", f"expected 'pushing', got '{s.actuation.contacts}': out of the plane, joint "
                   "torques are those for ground that only pushes")  # fmt: skip


def _in_vain(s: Scenario, read: Keys) -> Iterator[_Vain]:
    plain = Scenario()
    for key in _ASKED:
        if key not in read[""] and getattr(s, key) not in (getattr(plain, key), ""):
            yield _Vain("", key, None)
    for table in ALL:
        mine, default = getattr(s, table), getattr(plain, table)
        for key in mine.__struct_fields__:
            if key not in read[table] and getattr(mine, key) != getattr(default, key):
                yield _Vain(table, key, getattr(default, key))
    for i, change in enumerate(s.change):
        for key in change.actuation.__struct_fields__:
            if getattr(change.actuation, key) is not None:
                yield _Vain(f"change[{i}].actuation", key, None)


def _written(default: Any) -> str:
    """A default as its author would write it; of tables and lists, none."""
    if isinstance(default, bool):
        return str(default).lower()
    return echo(default) if isinstance(default, float | str) else "none"
