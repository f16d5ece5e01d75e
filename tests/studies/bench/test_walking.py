"""`biped bench walking`: its errors shrink as they must, and it recommends what its own table says."""

from __future__ import annotations

import numpy as np
import pytest

from biped.engines.home import simulate_with_ledger
from biped.measure.metrics.energy import loss_per_step
from biped.show.figures.studies import plot_walking
from biped.studies.bench import walking
from biped.studies.bench.walking import Case, cases, recommend, short, starts
from biped.studies.run import plan_of


@pytest.fixture(scope="module")
def start():
    _, trajectory, rows = starts(walking.SCENARIO, ["duration=5.0", "window.start=2.0", "window.end=5.0"])
    return trajectory, rows[::3]


def error(start, changes, fine) -> float:
    return float(np.median(np.abs(short(plan_of(walking.SCENARIO, changes).run(0), *start) - fine).max(axis=(1, 2))))


def test_error_falls_with_the_step(start):
    """Euler's error over a short horizon is of first order in the step; the reference is far below both."""
    fine = short(plan_of(walking.SCENARIO, walking.REFERENCE["mujoco"]).run(0), *start)
    again = short(plan_of(walking.SCENARIO, walking.REFERENCE["mujoco"]).run(0), *start)
    assert np.array_equal(fine, again)
    large, small = (error(start, [f"simulation.timestep={step}"], fine) for step in (0.001, 0.00025))
    assert 1e-6 < small < 0.5 * large < 0.01


@pytest.mark.parametrize("integrator", walking.INTEGRATORS)
def test_every_integrator_solves_the_same_problem(start, integrator):
    fine = short(plan_of(walking.SCENARIO, walking.REFERENCE["mujoco"]).run(0), *start)
    changes = [f"simulation.integrator={integrator}", "simulation.timestep=0.000125"]
    assert error(start, changes, fine) < 1e-3


def row(label: str, cpu: float, shift: float, half: float = 0.0, fell: int = 0, group: str = "steps"):
    return {
        "group": group, "label": label, "settings": [label], "cpu_per_second": cpu, "fell": fell,
        "own": label == "Euler 1 ms", "error": cpu**-1,
        "speed_shift": shift, "speed_shift_half_width": half,
        "cost_of_transport_shift": -shift, "cost_of_transport_shift_half_width": half,
    }  # fmt: skip


def test_recommendation_is_the_cheapest_that_holds():
    table = [
        row("A fell", 0.1, 0.0, fell=1), row("B model", 0.1, 0.0, group="contact"), row("C wrong", 0.2, 0.02),
        row("D vague", 0.3, 0.005, half=0.009), row("E good", 0.4, 0.004, half=0.001), row("F dear", 0.9, 0.0),
    ]  # fmt: skip
    assert recommend(table, 0.05)["label"] == "C wrong"
    assert recommend(table, 0.01)["label"] == "E good"
    assert recommend(table, 0.001)["label"] == "F dear"
    assert recommend(table[:-1], 0.001)["label"] is None
    # The scenario's own setting is kept where others are cheaper by chance only.
    assert recommend([*table, row("Euler 1 ms", 0.43, 0.0)], 0.01)["label"] == "Euler 1 ms"
    assert recommend([*table, row("Euler 1 ms", 0.45, 0.0)], 0.01)["label"] == "E good"


def test_half_a_walk_is_whole_strides(start):
    trajectory, _ = start
    (first, middle), (again, last) = walking.halves(trajectory, 1.0)
    assert middle == again
    assert first >= 1.0
    rows = np.array([round(t / trajectory.tick) for t in (first, middle, last)])
    assert (trajectory.down[rows, 0] & ~trajectory.down[rows - 1, 0]).all(), "the right foot has just landed"


def test_figure_and_cases(tmp_path):
    table = [row(f"{i} {s}", s, 0.01 * s) for i in walking.INTEGRATORS for s in (1.0, 2.0)]
    table += [row(f"home {s}", s, 0.01 * s, group="home") for s in (1.0, 2.0)]
    assert plot_walking({"cases": table, "horizon": 0.1}, tmp_path / "new").stat().st_size > 5000
    labels = [case.label for case in cases()]
    assert len(set(labels)) == len(labels)
    for case in cases():
        plan_of(walking.SCENARIO, case.changes)  # every setting is a possible scenario


def test_home_error_falls_with_the_fourth_power_of_the_step():
    """The home engine is of fourth order between events; starts are its own, since MuJoCo's feet are in the ground."""
    home = ["duration=5.0", "window.start=2.0", "window.end=5.0", "engine=home"]
    _, trajectory, rows = starts(walking.SCENARIO, home)
    start = trajectory, rows[::3]
    fine = short(plan_of(walking.SCENARIO, walking.REFERENCE["home"]).run(0), *start)
    large, small = (error(start, ["engine=home", f"simulation.timestep={s}"], fine) for s in (0.001, 0.00025))
    assert small < 0.1 * large < 1e-3


def test_energy_lost_is_what_the_home_engine_books():
    """Its ledger sums impact losses inside the engine; the metric only sees coordinates and what is applied."""
    run = plan_of(walking.SCENARIO, ["engine=home", "duration=4.0", "window.start=0.0", "window.end=4.0"]).run(0)
    t, record = simulate_with_ledger(run)
    n = len(t) - 1
    steps = sum(0 < row <= n for row, _ in t.strikes)
    # The last tick moves on from the last row of the log: its work is in the ledger alone.
    assert steps >= 4
    assert loss_per_step(t, (0.0, n * t.tick)) == pytest.approx(float(record["ledger"]["loss"][0]) / steps, rel=2e-3)


def test_control_rates_are_compared_at_the_same_moments(start):
    fine = short(plan_of(walking.SCENARIO, []).run(0), *start)
    for rate in (500, 2000):
        changes = [f"simulation.control_rate={rate}.0", f"simulation.timestep={min(0.001, 1.0 / rate)}"]
        assert short(plan_of(walking.SCENARIO, changes).run(0), *start).shape == fine.shape
        assert 0.0 < error(start, changes, fine) < 0.1


@pytest.mark.slow
def test_steady_gait_converges():
    """Halving Euler's step brings the steady speed nearer to the converged one, beyond both intervals."""
    result = walking.compare(
        chosen=[Case("steps", f"Euler {s}", (f"simulation.timestep={s}",)) for s in (1e-3, 2.5e-4)]
    )
    coarse, fine = result["cases"]
    assert abs(fine["speed_shift"]) < abs(coarse["speed_shift"]) < 0.01
    assert coarse["fell"] == fine["fell"] == 0
