"""How all figures look: colours that the colour-blind can tell apart, sizes that suit a README."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from biped.base.errors import InputError

RIGHT, LEFT, TRUNK = "#0072B2", "#D55E00", "#6B7280"
"""The legs and the trunk."""
JOINTS = {"hip": "#0072B2", "knee": "#E69F00", "ankle": "#009E73"}
STATES = {1: 1.0, 2: 0.68, 3: 0.16, 4: 0.34}
"""Leg states are shades of their leg's colour: full on the ground, pale in the air."""
PUSH = "#CC79A7"
QUIET = "#9AA3AD"
"""Colour of curves that are there for comparison."""

SETTINGS: dict[Any, Any] = {
    "font.size": 10.0,
    "axes.titlesize": 11.0,
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#E5E7EB",
    "axes.axisbelow": True,
    "lines.linewidth": 1.4,
    "legend.frameon": False,
    "text.parse_math": False,  # names of scenarios may hold dollars
}
"""Settings of matplotlib while a figure is made."""


def figure(width: float, height: float) -> Figure:
    """An empty figure of a size [inches of 110 pixels]; not one of pyplot's, which would need closing."""
    return Figure(figsize=(width, height), dpi=110, layout="constrained")


def timed(axes: Axes, title: str, label: str) -> Axes:
    """Labels axes whose abscissa is time."""
    axes.set_title(title)
    axes.set_ylabel(label)
    axes.set_xlabel("time [s]")
    return axes


def legend_above(axes: Axes, columns: int) -> None:
    """A legend right above the axes, where it hides nothing."""
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 0.97), ncols=columns, fontsize=8, borderaxespad=0.0)


def make_folder(folder: Path) -> None:
    """Makes the folder that figures go to, if need be.

    Raises:
        InputError: It cannot be made.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder}: cannot be made: {error.strerror}") from None


def save(drawn: Figure, path: Path) -> Path:
    """Writes a figure as PNG of 128 colours, a third of the size; the same figure gives the same bytes."""
    canvas = FigureCanvasAgg(drawn)
    canvas.draw()
    picture = Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB")
    try:
        picture.quantize(128).save(path, optimize=True)
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {error.strerror}") from None
    return path
