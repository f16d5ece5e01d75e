"""The live viewer: real time, pushes by hand reach the biped, a closed window ends it, no display is said."""

from __future__ import annotations

import sys
import time
from types import SimpleNamespace

import mujoco
import numpy as np
import pytest

from biped.base.errors import InputError
from biped.cli.main import main
from biped.engines.planar.mujoco import simulate
from biped.ensemble.plan import Plan
from biped.scenario.reading import read_scenario
from biped.show import viewer as live

SHORT = ["duration=0.6", "window.start=0.3", "window.end=0.6"]
PUSH = "push=[{at=0.1,duration=0.2,force=[150.0,0.0]}]"


class Viewer:
    """Stands for MuJoCo's: a hand that holds the torso with a spring from a tick on, and closes the window at one."""

    def __init__(self, hold=None, close=None):
        self.hold, self.close, self.syncs, self.places = hold, close, 0, []
        self.cam, self.opt, self.user_scn = mujoco.MjvCamera(), mujoco.MjvOption(), None
        self.perturb = mujoco.MjvPerturb()

    def __call__(self, model, data, **more):
        self.data = data
        return self

    def is_running(self):
        ended = len(self.places) > 3 and self.places[-1] == self.places[-2] == self.places[-3]
        return not ended and (self.close is None or self.syncs < self.close)

    def sync(self):
        self.syncs += 1
        self.places.append(self.data.time)
        self.data.xfrc_applied[:] = 0.0  # as the viewer does
        if self.hold is not None and self.syncs >= self.hold:
            self.perturb.select, self.perturb.active = 1, mujoco.mjtPertBit.mjPERT_TRANSLATE.value
            self.perturb.localpos[:], self.perturb.scale = 0.0, 1.0
            self.perturb.refselpos[:] = self.data.xipos[1] + [1.0, 0.0, 0.0]
            self.perturb.localmass = 75.0


@pytest.fixture
def plan():
    return Plan(read_scenario("level_normal", [*SHORT, PUSH]))


@pytest.fixture(autouse=True)
def clock(monkeypatch):
    """A clock that goes on only while somebody sleeps."""
    now = [0.0]
    monkeypatch.setattr(live, "time", SimpleNamespace(
        monotonic=lambda: now[0], sleep=lambda s: now.__setitem__(0, now[0] + s)
    ))  # fmt: skip
    return now


def test_it_goes_at_the_speed_of_life_and_is_the_run_itself(plan, clock, monkeypatch):
    logs = []
    monkeypatch.setattr(live, "simulate", lambda run, watch: logs.append(simulate(run, watch)) or logs[0])
    seen = live.watch(plan, 0, Viewer())
    assert seen.pushed == 0
    assert seen.seconds == pytest.approx(0.6)
    assert clock[0] >= 0.58
    # Scenario's pushes included, the ticks in Python are those of the compiled loop.
    np.testing.assert_allclose(logs[0].q, simulate(plan.run(0)).q, atol=1e-6)


def test_a_hand_pushes(plan):
    held = live.watch(plan, 0, Viewer(hold=3))
    assert held.pushed > 200
    assert held.said.startswith("fell forward")  # the way it was pulled
    assert live.watch(plan, 0, Viewer()).said == "stayed up to the end"


def test_a_closed_window_ends_it(plan):
    seen = live.watch(plan, 0, Viewer(close=4))
    assert seen.said == "the window was closed"
    assert 0.05 < seen.seconds < 0.12


def test_without_a_display_it_says_what_to_do(monkeypatch, capsys):
    monkeypatch.setattr(sys, "platform", "linux")
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    began = time.monotonic()
    assert main(["run", "level_normal", "--live"]) == 2
    printed = capsys.readouterr()
    assert printed.out == ""  # nothing of what hands could do in a window that there is not
    said = " ".join(printed.err.split())
    assert "--live: there is no display here" in said
    assert "biped view --web" in said
    assert time.monotonic() - began < 60.0


@pytest.mark.parametrize("argv", [["--record"], ["--out", "x"], ["--json"], ["level_slow"], ["--only", "3"]])
def test_bad_input(argv, capsys):
    assert main(["run", "level_normal", *argv, "--live"]) == 2
    assert argv[0] in capsys.readouterr().err or argv == ["level_slow"]


def test_home_has_no_viewer():
    plan = Plan(read_scenario("level_normal", [*SHORT, "engine=home"]))
    with pytest.raises(InputError, match="expected --engine mujoco"):
        live.watch(plan, 0, Viewer())
