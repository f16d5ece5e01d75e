import pytest

from biped.dynamics.bench.figures import draw_tolerances
from biped.dynamics.bench.tables import print_tolerances
from biped.dynamics.bench.tolerances import AdaptiveRun, cases, measure, slope


def test_one_problem_is_measured_shown_and_drawn(tmp_path, capsys):
    pendulum = next(case for case in cases() if case.name == "pendulum")
    reached = measure((pendulum,), (1e-4, 1e-8))
    assert [r.tolerance for r in reached] == [1e-4, 1e-8]
    assert slope(reached) == pytest.approx(1.0, abs=0.1)
    ended = AdaptiveRun("pendulum", 1e-14, None, None, "at t = 1 s no step passes")
    print_tolerances([*reached, ended])
    out = capsys.readouterr().out
    assert "error" in out
    assert "pendulum, 1e-14: at t = 1 s no step passes" in out
    draw_tolerances([*reached, ended], tmp_path / "new")
    assert (tmp_path / "new" / "tolerances.png").stat().st_size > 10_000


def test_a_run_that_ends_with_an_error_says_why():
    chain = next(case for case in cases() if case.name.startswith("chain of 2"))
    (reached,) = measure((chain,), (1e-14,))
    assert reached.error is None
    assert "no step passes the error test" in reached.note


def test_every_problem_has_a_name_of_its_own():
    names = [case.name for case in cases()]
    assert len(set(names)) == len(names) == 14 - 1
