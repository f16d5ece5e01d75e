"""Trajectories from files, whichever kind of robot they are of."""

from __future__ import annotations

import json
import zlib
from pathlib import Path
from typing import TYPE_CHECKING
from zipfile import BadZipFile

import msgspec
import numpy as np

from biped.base.errors import InputError
from biped.measure.trajectory import loaded

if TYPE_CHECKING:
    from biped.measure.general.trajectory import GeneralTrajectory
    from biped.measure.trajectory import Trajectory

    AnyTrajectory = Trajectory | GeneralTrajectory


def load(path: Path) -> AnyTrajectory:
    """Reads what a trajectory's `save` wrote.

    Raises:
        InputError: The file is missing or is not a trajectory.
    """
    try:
        with open(path, "rb") as opened, np.load(opened, allow_pickle=False) as file:
            about = json.loads(str(file["about"]))
            if "kind" in about:
                from biped.measure.general import trajectory as general

                return general.loaded(about, file)
            return loaded(about, file)
    except (OSError, EOFError, KeyError, TypeError, ValueError, AttributeError, BadZipFile, MemoryError, zlib.error,
            NotImplementedError, RecursionError, msgspec.ValidationError) as error:  # fmt: skip
        raise InputError(
            f"{path}: not a trajectory: {' '.join(str(error).split())[:200]}; remove it to have it simulated again"
        ) from None
