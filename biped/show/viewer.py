"""Viewers: of a recording in rerun, and of a run while it goes on in MuJoCo.

A recording is seen below a notebook's cell, in a window of its own, or in a browser, to which it is served on this
machine alone, with a word on how to reach it from another. A live run goes at the speed of life, and the mouse pushes.
"""

import getpass
import math
import os
import socket
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import quote

import mujoco
import numpy as np

from biped.base.errors import InputError
from biped.engines.mujoco import simulate
from biped.ensemble.plan import Plan
from biped.robot.ground import Profile, slabs
from biped.scenario.world import PLANE
from biped.show.spatial import light_evenly

PAGES, DATA = 9090, 9876
"""Ports of the viewer and of its data, if they are free."""
HERE = "127.0.0.1"
"""The only address that is listened to: a recording is nobody else's business."""


class Served(NamedTuple):
    """A recording that is served.

    Attributes:
        command: What serves it.
        url: What to open in a browser.
        tunnel: What to type on another machine first.
    """

    command: list[str]
    url: str
    tunnel: str


def served(recording: Path) -> Served:
    """How to serve a recording, on ports that are free now."""
    pages = _free(PAGES)
    data = _free(DATA)
    command = [
        sys.executable, "-m", "rerun", "--serve-web", "--bind", HERE, "--port", str(data), "--web-viewer-port",
        str(pages), str(recording),
    ]  # fmt: skip
    url = f"http://localhost:{pages}/?url={quote(f'rerun+http://localhost:{data}/proxy', safe='')}"
    ports = f"-L {pages}:localhost:{pages} -L {data}:localhost:{data}"
    return Served(command, url, f"ssh -N {ports} {_user()}@{socket.gethostname()}")


def has_display() -> bool:
    """Whether a window can be opened: elsewhere than on Linux there is a screen unless somebody came by ssh."""
    if sys.platform == "linux":
        return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
    return "SSH_CONNECTION" not in os.environ


def quiet() -> dict[str, str]:
    """The environment in which the viewer's server says only what is wrong."""
    return {"RUST_LOG": "warn", **os.environ}


def _free(port: int) -> int:
    """The port if it is free, or another one."""
    for wanted in (port, 0):
        with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as door:
            door.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                door.bind((HERE, wanted))
            except OSError:
                continue
            return int(door.getsockname()[1])
    return port


def _user() -> str:
    try:
        return getpass.getuser()
    except (OSError, KeyError):  # an account without a name
        return "you"


def open_viewer(path: Path) -> None:
    """Shows a recording and does not wait.

    Args:
        path: The .rrd file; a server in a browser's place ends with this process.
    """
    if _in_notebook():
        import rerun
        import rerun.notebook

        if rerun.notebook.HAS_NOTEBOOK:
            recording = rerun.RecordingStream("biped")
            recording.log_file_from_path(path)
            rerun.notebook_show(recording=recording)
            return
    if has_display():
        subprocess.Popen([sys.executable, "-m", "rerun", str(path)], start_new_session=True)
        return
    found = served(path)
    print(f"no display here: open {found.url}\nfrom afar, first: {found.tunnel}")
    _serving.append(ends_with_this_process(found.command))


def ends_with_this_process(command: list[str]) -> subprocess.Popen[bytes]:
    """Starts a command that ends when this process does, however it ends: whoever watches it reads a pipe from here."""
    return subprocess.Popen(
        [sys.executable, "-c", _WATCH, *command], stdin=subprocess.PIPE, start_new_session=True, env=quiet()
    )


_serving: list[subprocess.Popen[bytes]] = []
"""Watchers of servers: their pipes stay open as long as this process lives."""
_WATCH = """
import os, signal, subprocess, sys
served = subprocess.Popen(sys.argv[1:], stdin=subprocess.DEVNULL, start_new_session=True)
sys.stdin.buffer.read()
if hasattr(os, "killpg"):
    try:
        os.killpg(served.pid, signal.SIGTERM)
    except ProcessLookupError:
        pass
else:
    served.terminate()
served.wait()
"""
"""Ends a command and all that it started: rerun's own command starts the server as another process."""


def _in_notebook() -> bool:
    """Whether a notebook's kernel runs this process; a terminal's IPython is none."""
    shell = sys.modules["IPython"].get_ipython() if "IPython" in sys.modules else None
    return getattr(shell, "kernel", None) is not None


RATE = 60.0
"""[Hz] of pictures."""
HANDS = "Double-click a body, then hold Ctrl and drag with the right button to push it; close the window to end."
_RULER = range(-5, 60)
_FAR, _DOWN = 3.4, -8.0
"""[m], [degrees] of the camera from what it follows."""


class WatchedRun(NamedTuple):
    """How a watched run ended.

    Attributes:
        said: In words.
        pushed: Ticks in which the mouse pushed.
        seconds: [s] simulated.
    """

    said: str
    pushed: int
    seconds: float


class _Closed(Exception):
    """The window was closed."""


class _Show:
    """Work after every tick: the mouse's forces, a picture now and then, and waiting for the clock."""

    def __init__(self, viewer: Any, tick: float):
        self.viewer, self.tick = viewer, tick
        self.pushed, self.done = 0, 0
        self._each = max(1, round(1.0 / (RATE * tick)))
        self._began = time.monotonic()

    def __call__(self, model: mujoco.MjModel, data: mujoco.MjData, forces: np.ndarray) -> None:
        self.done += 1
        data.xfrc_applied[:] = 0.0
        mujoco.mjv_applyPerturbForce(model, data, self.viewer.perturb)
        self.pushed += bool(data.xfrc_applied.any())
        data.xfrc_applied[1:, [0, 2] if forces.shape[1] == PLANE else [0, 1, 2]] += forces
        if self.done % self._each:
            return
        if not self.viewer.is_running():
            raise _Closed
        kept = data.xfrc_applied.copy()  # a picture takes the mouse's forces anew, and the scenario's with them
        self.viewer.sync()
        data.xfrc_applied[:] = kept
        ahead = self._began + self.done * self.tick - time.monotonic()
        if ahead > 0.0:
            time.sleep(ahead)


def watch(
    plan: Plan, index: int, launch: Callable[..., Any] | None = None, tell: Callable[[str], None] | None = None
) -> WatchedRun:
    """Carries out a run in a window, in real time; the window stays open when it ends.

    Args:
        plan: What is run.
        index: Number of the run.
        launch: Opens the viewer, as `mujoco.viewer.launch_passive` does.
        tell: Told what hands can do, once it is known that a window can be opened.

    Raises:
        InputError: There is no display, or the run is not one of MuJoCo.
    """
    run = plan.run(index)
    if run.scenario.engine != "mujoco":
        raise InputError(f"--live: engine = '{run.scenario.engine}' has no viewer; expected --engine mujoco")
    launch = launch or _launcher()
    if tell is not None:
        tell(HANDS)
    opened: list[_Show] = []

    def after(model: mujoco.MjModel, data: mujoco.MjData, forces: np.ndarray) -> None:
        if not opened:
            viewer = launch(model, data, show_left_ui=False, show_right_ui=False)
            _arrange(viewer, model, run.robot.base, run.profile)
            opened.append(_Show(viewer, 1.0 / run.scenario.simulation.control_rate))
        opened[0](model, data, forces)

    try:
        trajectory = simulate(run, after)
    except _Closed:
        show = opened[0]
        return WatchedRun("the window was closed", show.pushed, show.done * show.tick)
    show = opened[0]
    said = trajectory.cause or "stayed up to the end"
    while show.viewer.is_running():
        show.viewer.sync()
        time.sleep(1.0 / RATE)
    return WatchedRun(said, show.pushed, len(trajectory) * show.tick)


def _launcher() -> Callable[..., Any]:
    """MuJoCo's viewer, if a window can be opened here.

    Raises:
        InputError: It cannot.
    """
    hint = "elsewhere: biped run SCENARIO --record, then biped view --web"
    if not has_display():
        raise InputError(f"--live: there is no display here; {hint}")
    import glfw
    import mujoco.viewer

    if sys.platform == "darwin" and mujoco.viewer._MJPYTHON is None:
        raise InputError(f"--live: on macOS a window needs mjpython: mjpython -m biped.cli.main run …; {hint}")
    if not glfw.init():  # the viewer itself would wait for ever
        raise InputError(f"--live: the display cannot be opened; {hint}")
    return mujoco.viewer.launch_passive


def _arrange(viewer: Any, model: mujoco.MjModel, base: str, ground: Profile) -> None:
    """The camera follows from the side; the ground is seen, with a mark at every metre."""
    viewer.cam.type = mujoco.mjtCamera.mjCAMERA_TRACKING.value
    viewer.cam.trackbodyid = model.body(base).id
    viewer.cam.distance, viewer.cam.azimuth, viewer.cam.elevation = _FAR, 90.0, _DOWN
    viewer.opt.geomgroup[3] = 1
    light_evenly(model)
    scene = viewer.user_scn
    for metre in _RULER:
        place = np.array([metre, 0.0, float(ground.height(np.array(metre)))])
        label = f"{metre} m" if math.fmod(metre, 2) == 0 else ""
        _add_box(scene, np.array([0.008, 0.3, 0.001]), place, np.eye(3), (0.2, 0.22, 0.24), label)
    if ground.level:
        return
    model.geom_rgba[model.geom_type == mujoco.mjtGeom.mjGEOM_PLANE, 3] = 0.0  # a run on such ground has its own model
    for (x, z), length, angle, odd in zip(*slabs(ground, _RULER[0], _RULER[-1], 1.0), strict=True):
        c, s = math.cos(angle), math.sin(angle)
        size, place = np.array([0.5 * length, 0.5, 0.02]), np.array([x + 0.02 * s, 0.0, z - 0.02 * c])
        turn = np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]])
        _add_box(scene, size, place, turn, (0.8, 0.82, 0.8) if odd else (0.69, 0.72, 0.71))


def _add_box(
    scene: Any, size: np.ndarray, place: np.ndarray, turn: np.ndarray, colour: tuple[float, ...], label: str = ""
) -> None:
    if scene is None or scene.ngeom >= scene.maxgeom:
        return
    geom = scene.geoms[scene.ngeom]
    mujoco.mjv_initGeom(
        geom, mujoco.mjtGeom.mjGEOM_BOX, size, place, turn.ravel(), np.array([*colour, 1.0], np.float32)
    )
    geom.label = label
    scene.ngeom += 1
