import json
from importlib.util import find_spec

import numpy as np
import pytest

from biped.cli.main import main
from biped.dynamics.bench import chapter2, integrators, mechanisms, peers
from biped.dynamics.bench.figures import draw_work_precision
from biped.dynamics.bench.mechanisms import FOUR_BARS, PENDULUM, TimedRun, ratios
from biped.dynamics.bench.problems import PROBLEMS
from biped.dynamics.bench.tables import print_mechanisms


def test_a_ratio_is_taken_at_equal_error_or_less():
    def point(method, ours, error, cpu):
        return TimedRun(FOUR_BARS, method, ours, 1e-2, error, cpu)

    points = [
        point("RK4", True, 1e-3, 1.0),
        point("RK8", True, 1e-6, 2.0),
        point("RK4, energy scaled", False, 1e-9, 0.1),
        point("exudyn", False, 2e-3, 50.0),
        point("exudyn", False, 1e-5, 300.0),
        point("exudyn", False, 1e-8, 900.0),
        point("MuJoCo connect", False, None, None),
    ]
    assert ratios(points) == {"exudyn": [50.0, 150.0]}


@pytest.mark.parametrize(
    ("prepare", "setting", "bound"),
    [
        pytest.param(peers.mujoco_connect, 1e-3, 1e-2, marks=pytest.mark.slow),  # 50 s
        pytest.param(peers.pinocchio_proximal, 1e-2, 1e-5, marks=pytest.mark.slow),  # 50 s
        (lambda rtol: integrators.scipy_chain(2, rtol), 1e-9, 1e-4),
    ],
)
def test_peers_simulate_the_same_mechanism(prepare, setting, bound):
    exact = mechanisms.exact(FOUR_BARS)
    assert np.abs(prepare(setting)() - exact).max() < bound


@pytest.mark.slow
def test_the_benchmark_prints_one_json_object_with_every_method(capsys):
    assert main(["bench", "mechanisms", "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    methods = {(p["problem"], p["method"]) for p in report["points"]}
    assert {(PENDULUM, "RK4"), (FOUR_BARS, "RK8"), (FOUR_BARS, "MuJoCo connect")} <= methods
    assert {"MuJoCo connect", "Pinocchio proximal"} <= set(report["ratios"])
    assert set(report["large"]) == {"Pinocchio proximal", "scipy index 1"}
    for problem in ("chain of 10 four-bars", "chain of 40 four-bars", "squeezer", "Bricard's six-bar"):
        assert (problem, "RK8") in methods
    for name, module in (("exudyn", "exudyn"), ("SUNDIALS IDA", "sksundae")):
        assert (name in report["skipped"]) == (find_spec(module) is None)


def test_the_quick_benchmark_prints_every_method_and_draws_all_figures(tmp_path, capsys):
    small = [problem for problem in PROBLEMS if problem.name in (PENDULUM, FOUR_BARS)]
    report = mechanisms.measure(quick=True, problems=small)
    print_mechanisms(report)
    out = capsys.readouterr().out
    for method in ("RK4", "RK8", "MuJoCo connect", "Pinocchio proximal"):
        assert method in out
    for name, module in (("exudyn", "exudyn"), ("SUNDIALS IDA", "sksundae")):
        assert (f"{name}: skipped" in out) == (find_spec(module) is None)
    draw_work_precision(report.points, tmp_path / "figures")
    chapter2.draw(tmp_path / "figures")
    drawn = {path.name for path in (tmp_path / "figures").iterdir()}
    assert {f"fig_2_{k}.png" for k in (1, 2, 3, 4, 5, 6, 8, 9, 10)} < drawn
    assert {f"work_precision_{problem.replace(' ', '_')}.png" for problem in (PENDULUM, FOUR_BARS)} < drawn
