"""A canvas off the screen that MuJoCo draws on: EGL where there is one, else OSMesa, else a sentence."""

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import mujoco
import numpy as np

from biped.base.errors import InputError

_PROBE = "from mujoco.{0} import GLContext; c = GLContext(16, 16); c.make_current()"
_HINT = "Debian: apt-get install libegl1 libgl1-mesa-dri, or libosmesa6"
_PATIENCE = 60.0


class Canvas:
    """Where frames are drawn.

    Args:
        model: The model, whose context is made; its off-screen size is set.
        width: [px].
        height: [px].
        current: Makes its context of OpenGL the one that is drawn with.

    Attributes:
        height: [px].
    """

    def __init__(self, model: mujoco.MjModel, width: int, height: int, current: Callable[[], None]):
        current()
        self._current, self.height = current, height
        model.vis.global_.offwidth, model.vis.global_.offheight = width, height
        self._view = mujoco.MjrRect(0, 0, width, height)
        letters = mujoco.mjtFontScale.mjFONTSCALE_100 if height < 900 else mujoco.mjtFontScale.mjFONTSCALE_200
        self._context = mujoco.MjrContext(model, letters.value)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, self._context)
        self._pixels = np.empty((height, width, 3), np.uint8)

    def draw(self, scene: mujoco.MjvScene, names: str, values: str) -> np.ndarray:
        """A scene with two columns of words in its corner as (height, width, 3) bytes; valid until the next."""
        self._current()
        mujoco.mjr_render(self._view, scene, self._context)
        place = mujoco.mjtGridPos.mjGRID_TOPLEFT.value
        mujoco.mjr_overlay(mujoco.mjtFont.mjFONT_NORMAL.value, place, self._view, names, values, self._context)
        mujoco.mjr_readPixels(self._pixels, None, self._view, self._context)
        return self._pixels[::-1]

    def close(self) -> None:
        """Frees what the context holds."""
        self._current()
        self._context.free()


@contextmanager
def off_screen(model: mujoco.MjModel, width: int, height: int) -> Iterator[Canvas]:
    """A canvas until the block ends.

    Raises:
        InputError: Nothing here can draw.
    """
    context = _context(width, height)
    try:
        drawn = Canvas(model, width, height, context.make_current)
        try:
            yield drawn
        finally:
            drawn.close()
    finally:
        context.free()


def platform() -> str:
    """The library that draws off the screen on Linux: what MUJOCO_GL says, else the first that works.

    Each is tried in a process of its own: one that is broken may end it.

    Raises:
        InputError: None works.
    """
    wanted = os.environ.get("MUJOCO_GL", "").lower().strip()
    choice = (wanted,) if wanted in ("egl", "osmesa") else ("egl", "osmesa")
    for name in choice:
        environment = {key: value for key, value in os.environ.items() if key != "PYOPENGL_PLATFORM"}
        try:
            done = subprocess.run(
                [sys.executable, "-c", _PROBE.format(name)], env=environment, capture_output=True, timeout=_PATIENCE,
                check=False,
            )  # fmt: skip
        except subprocess.TimeoutExpired:
            continue
        if done.returncode == 0:
            return name
    raise InputError(f"video: MuJoCo cannot draw here: tried {' and '.join(choice)}, neither works; {_HINT}")


def _context(width: int, height: int):
    """A context of OpenGL off the screen."""
    if sys.platform != "linux":
        from mujoco.gl_context import GLContext

        return GLContext(width, height)
    name = platform()
    os.environ["PYOPENGL_PLATFORM"] = name
    if name == "egl":
        from mujoco.egl import GLContext
    else:
        from mujoco.osmesa import GLContext
    return GLContext(width, height)
