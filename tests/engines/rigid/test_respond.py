"""The motion by lanes is that of the general factorisation, and what is kept from a step's end is what it would be."""

from __future__ import annotations

import numpy as np
import pytest

from biped.base.jit import kernel
from biped.engines import home
from biped.engines.rigid import motion
from biped.engines.rigid.events import advance
from biped.ensemble.plan import Plan
from biped.scenario.reading import read_scenario

NAMES = ("v_dot", "q_dot", "shift", "lam")


@kernel
def _general(record, q, v):
    w = record[0]
    motion.place(w, q, v)
    motion.mass_and_bias(w)
    motion.gaps(w, q, v)
    motion._forces(w, v)
    motion._respond_dependent(w, q, v)


@kernel
def _lanes(record, q, v):
    motion.evaluate(record[0], q, v)


@kernel
def _again(record, q, v):
    motion.evaluate_again(record[0], q, v)


def found(record) -> dict[str, np.ndarray]:
    return {name: record[0]["motion"][name].copy() for name in NAMES}


def same(ours: dict[str, np.ndarray], theirs: dict[str, np.ndarray]) -> None:
    for name, value in theirs.items():
        np.testing.assert_allclose(ours[name], value, rtol=0, atol=1e-11 * max(1.0, np.abs(value).max()), err_msg=name)


@pytest.fixture(scope="module")
def ticks():
    """Copies of the engine's record at every seventh tick of a second of walking, with q and v."""
    kept = []

    def watched(record, q, v, step, steps):
        if len(kept) % 7 == 0:
            kept.append((record.copy(), q.copy(), v.copy()))
        else:
            kept.append(None)
        advance(record, q, v, step, steps)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(home, "advance", watched)
        patch.setattr(home, "COMPILED", False)
        changes = ["engine='home'", "duration=1.0", "window.start=0.0", "window.end=1.0"]
        home.simulate(Plan(read_scenario("level_normal", changes)).run(0))
    return [one for one in kept if one is not None]


def test_lanes_find_what_the_general_factorisation_finds(ticks):
    sets = set()
    for record, q, v in ticks:
        _lanes(record, q, v)
        assert record[0]["rows"]["independent"]
        ours = found(record)
        _general(record, q, v)
        same(ours, found(record))
        sets.add(record[0]["contact"]["active"].tobytes())
    assert len(sets) > 4


def test_other_forces_need_nothing_else_anew(ticks):
    rng = np.random.default_rng(0)
    for record, q, v in ticks[::5]:
        _lanes(record, q, v)
        record[0]["acting"]["Q"] += 10.0 * rng.normal(size=9)
        _again(record, q, v)
        ours = found(record)
        _lanes(record, q, v)
        same(ours, found(record))


def test_dependent_rows_are_solved_in_general(ticks):
    """Both feet flat and both knees at their stops, legs side by side: the closed chain has a row too many."""
    record = ticks[0][0].copy()
    w = record[0]
    w["contact"]["active"], w["contact"]["held"] = 1, 0
    q = np.zeros(9)
    w["contact"]["anchor"] = 0.0
    _lanes(record, q, np.zeros(9))
    assert not w["rows"]["independent"]
    a = w["motion"]["v_dot"]
    assert np.isfinite(a).all()
    np.testing.assert_allclose(w["system"]["A"][:8] @ a, w["system"]["b_v"][:8], atol=1e-7)


def test_a_step_goes_on_from_the_end_of_the_one_before(ticks):
    for record, q, v in ticks[5::9]:
        ends = []
        for known in (True, False):
            one, q1, v1 = record.copy(), q.copy(), v.copy()
            advance(one, q1, v1, 1e-3, 1)
            if not known:
                one[0]["state"]["known"] = 0
            one[0]["acting"]["Q"][3:] += 5.0
            advance(one, q1, v1, 1e-3, 1)
            ends.append(np.r_[q1, v1])
        np.testing.assert_allclose(ends[0], ends[1], rtol=0, atol=1e-11)
