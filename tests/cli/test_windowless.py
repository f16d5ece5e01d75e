"""Commands leave MuJoCo's windows out, and nobody who wants them notices."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import pytest

CODE = """
import json, os, sys
from biped.cli.main import main
code = main(["run", "no_such_scenario"])
import mujoco
before = "glfw" in sys.modules, "MUJOCO_GL" in os.environ, hasattr(mujoco, "nonsense")
plain = mujoco.MjModel.from_xml_string("<mujoco/>").nv
from mujoco import Renderer
import mujoco.rendering.classic.renderer as classic
from mujoco.rendering.classic.gl_context import GLContext
same = Renderer is mujoco.Renderer is classic.Renderer, GLContext is mujoco.GLContext is classic.GLContext
print(json.dumps([code, before, plain, same, GLContext.__module__]))
"""


@pytest.mark.parametrize("asked", ["", "egl"])
def test_what_draws_is_there_for_whoever_asks(tmp_path, asked):
    environment = {key: value for key, value in os.environ.items() if key != "MUJOCO_GL"}
    plainly = subprocess.run(
        [sys.executable, "-c", "import mujoco; print(mujoco.GLContext.__module__)"],
        env=environment | ({"MUJOCO_GL": asked} if asked else {}), capture_output=True, text=True, check=True,
    )  # fmt: skip
    done = subprocess.run(
        [sys.executable, "-c", CODE], cwd=tmp_path, env=environment | ({"MUJOCO_GL": asked} if asked else {}),
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    code, (window, said, nonsense), nv, same, context = json.loads(done.stdout)
    assert (code, nv, nonsense) == (2, 0, False)
    assert not window
    assert said == bool(asked)
    assert same == [True, True]
    assert context == plainly.stdout.strip()
