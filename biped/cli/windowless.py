"""MuJoCo without its windows: importing them starts a process only to ask a library for its version.

That takes an eighth of what ten seconds of walking cost. Whoever asks for them afterwards gets them as ever.
"""

import os
import sys
from importlib import import_module
from typing import Any

from biped.base.errors import InputError
from biped.base.text import safe

SETTING = "MUJOCO_GL"
_DRAWING = {"Renderer": "mujoco.renderer", "GLContext": "mujoco.gl_context"}
"""Libraries that draw, and the module that each comes from."""
_OF_DRAWING = ("mujoco.rendering", "mujoco.renderer", "mujoco.gl_context")


def import_mujoco() -> None:
    """Imports MuJoCo; what draws is imported when it is first asked for.

    With MUJOCO_GL somebody has said what he wants to draw with, and MuJoCo is left alone.

    Raises:
        InputError: MuJoCo cannot draw with that.
    """
    if "mujoco" in sys.modules:
        return
    if SETTING in os.environ:
        try:
            import_module("mujoco")
        except Exception as error:  # whatever a library of graphics raises that is not there
            what = f"MUJOCO_GL={safe(os.environ[SETTING])}: MuJoCo cannot draw with it: {safe(error)}"
            raise InputError(f"{what}; expected egl, osmesa or glfw, as far as it is installed, or nothing") from None
        return
    os.environ[SETTING] = "disable"
    try:
        mujoco: Any = import_module("mujoco")
    finally:
        del os.environ[SETTING]
    for name in [name for name in sys.modules if name.startswith(_OF_DRAWING)]:
        del sys.modules[name]
    for name in ("Renderer", "rendering", "renderer", "gl_context"):
        vars(mujoco).pop(name, None)
    mujoco.__getattr__ = _drawing


def _drawing(name: str) -> Any:
    """The library that a module lacks, if it is one that draws."""
    if name not in _DRAWING:
        raise AttributeError(f"module 'mujoco' has no attribute '{name}'")
    found = getattr(import_module(_DRAWING[name]), name)
    setattr(sys.modules["mujoco"], name, found)
    return found
