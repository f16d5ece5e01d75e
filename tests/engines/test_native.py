"""What compiled code takes for granted of MuJoCo is checked; where it does not hold, the engine says so and goes on."""

from __future__ import annotations

import ctypes
import threading
from weakref import WeakKeyDictionary

import mujoco
import numpy as np
import pytest

from biped.engines import native
from biped.engines.planar import mujoco as engine
from biped.ensemble.plan import Plan
from biped.robot.planar.build import compile_foreign
from biped.robot.planar.order import Order
from biped.scenario.keys import Scenario, Start
from tests.ticks import HUMAN

SHORT = Scenario(duration=0.1, start=Start(posture="heel_toe"))


@pytest.fixture(scope="module")
def foreign():
    compiled = compile_foreign(HUMAN, SHORT)
    return compiled.model, compiled.order


def clock() -> int | None:
    return ctypes.c_void_p.in_dll(native._shared(), "mjcb_time").value


def test_compiled_code_can_step_here(foreign):
    assert native.reason(*foreign) == ""


def test_remembered_offsets_are_those_that_mujoco_describes():
    version = mujoco.mj_versionString()
    assert native._OFFSETS[version] == native.offsets(native.FIELDS)
    assert native._CONTACT[version] == native.contact_offsets()


def test_a_field_that_mujoco_does_not_describe():
    with pytest.raises(KeyError, match="efc_strength"):
        native.offsets(("nefc", "efc_strength"))


def broken_offsets(patch):
    patch.setitem(
        native._OFFSETS,
        mujoco.mj_versionString(),
        (native._library().nefc, native._library().force - 8, *native._library()[4:]),
    )
    native._library.cache_clear()


def unknown_version(patch):
    patch.delitem(native._OFFSETS, mujoco.mj_versionString())
    patch.setattr(native, "offsets", lambda names: (_ for _ in ()).throw(KeyError(names[0])))
    native._library.cache_clear()


def no_library(patch):
    patch.setattr(mujoco, "__file__", "/nowhere/__init__.py")
    native._shared.cache_clear()
    native._library.cache_clear()


def no_addresses(patch):
    class Bare:
        def __init__(self, model):
            pass

    patch.setattr(native.mujoco, "MjData", Bare)


def another_order(patch):
    patch.setattr(Order, "canonical", False)


BREAKS = {broken_offsets: "not where", unknown_version: "not described", no_library: "no single", no_addresses: "tell",
          another_order: "order of its own"}  # fmt: skip


@pytest.mark.parametrize("breaks", BREAKS, ids=lambda b: b.__name__)
def test_what_does_not_hold_is_said_and_the_run_is_the_same(breaks, foreign, monkeypatch):
    run = Plan(SHORT).run(0)
    usual = engine.simulate(run)
    with monkeypatch.context() as patch:
        patch.setattr(native, "_reasons", WeakKeyDictionary())
        breaks(patch)
        assert BREAKS[breaks] in native.reason(*foreign)
        if breaks is not no_addresses:  # the Python loop needs data of its own
            np.testing.assert_array_equal(engine.simulate(run).log, usual.log)
    native._shared.cache_clear()
    native._library.cache_clear()
    assert native.reason(*foreign) == ""


def test_another_versions_offsets_are_asked_for(foreign, monkeypatch):
    monkeypatch.setattr(native, "_reasons", WeakKeyDictionary())
    monkeypatch.delitem(native._OFFSETS, mujoco.mj_versionString())
    native._library.cache_clear()
    assert native.reason(*foreign) == ""
    assert mujoco.mj_versionString() in native._OFFSETS
    native._library.cache_clear()


def test_the_clock_stops_and_comes_back():
    before = clock()
    assert before
    with native.without_clock():
        assert clock() is None
        with native.without_clock():
            assert clock() is None
        assert clock() is None
    assert clock() == before


def test_the_clock_comes_back_when_the_last_thread_is_done():
    before, entered, leave = clock(), threading.Event(), threading.Event()

    def other():
        with native.without_clock():
            entered.set()
            leave.wait(10.0)

    thread = threading.Thread(target=other)
    with native.without_clock():
        thread.start()
        assert entered.wait(10.0)
    assert clock() is None
    leave.set()
    thread.join()
    assert clock() == before


def test_an_error_brings_the_clock_back():
    before = clock()
    with pytest.raises(ZeroDivisionError), native.without_clock():
        raise ZeroDivisionError
    assert clock() == before


def test_a_clock_of_the_users_own_is_left_alone(foreign):
    ticks = []
    mujoco.set_mjcb_time(lambda: float(len(ticks)) if ticks.append(0) is None else 0.0)
    try:
        with native.without_clock():
            mujoco.mj_step(foreign[0], mujoco.MjData(foreign[0]))
        assert ticks
        assert mujoco.get_mjcb_time() is not None
    finally:
        mujoco.set_mjcb_time(None)


def test_runs_leave_the_clock_as_it_was():
    before = clock()
    engine.simulate(Plan(SHORT).run(0))
    assert clock() == before
