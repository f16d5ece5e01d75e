"""The programs of docs/dynamics.md run as they are printed, and say what they promise."""

import re
from pathlib import Path

import numpy as np
import pytest

from biped.dynamics.mechanisms import pendulum

PAGE = Path(__file__).parents[2] / "docs" / "dynamics.md"
PROGRAMS = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)


@pytest.fixture
def run(tmp_path, monkeypatch):
    """Run a program in a file of its own, in an empty folder."""
    import matplotlib

    monkeypatch.chdir(tmp_path)
    matplotlib.use("Agg")

    def run(text):
        path = tmp_path / "program.py"
        path.write_text(text, encoding="utf-8")
        space = {"__name__": "program", "__file__": str(path)}
        exec(compile(text, str(path), "exec"), space)
        return space

    yield run
    import matplotlib.pyplot as plt

    plt.close("all")  # as when a program ends


def test_a_mechanism_of_plain_functions(run, capsys):
    motion = run(PROGRAMS[0])["motion"]
    assert motion.t[-1] == pytest.approx(10.0)
    np.testing.assert_allclose(motion.q, pendulum.exact(motion.t), atol=1e-9)
    assert float(capsys.readouterr().out.split()[-1]) == motion.phi.max()


def test_from_a_sketch_to_joint_forces_and_an_animation(run, capsys, tmp_path):
    space = run(PROGRAMS[1])
    motion, plane = space["motion"], space["plane"]
    printed = capsys.readouterr().out
    force = float(re.search(r"bearing (\S+) N", printed)[1])
    assert force == pytest.approx(np.linalg.norm(space["force"], axis=1).max())
    work = float(re.search(r"motor (\S+) J", printed)[1])
    assert work == pytest.approx(motion.energy[-1] - motion.energy[0], abs=1e-6)
    # Newton for all three bodies: bearing, guide and weight move their centres of mass, half a rod out.
    a = [motion.acceleration[:, body.first : body.first + 4] for body in plane.bodies]
    momentum = sum(x[:, :2] for x in a) + 0.5 * (a[0][:, 2:] + a[1][:, 2:])
    held = space["force"] + plane.joint_forces(motion, space["guide"])[0]
    np.testing.assert_allclose(momentum, [0.0, -3 * 9.81] - held, atol=1e-8)
    assert (tmp_path / "slider_crank.gif").read_bytes()[:6] == b"GIF89a"
