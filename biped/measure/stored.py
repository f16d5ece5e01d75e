"""Trajectories from files, of this version and of all before it."""

import json
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import msgspec
import numpy as np

from biped.base.errors import InputError, why
from biped.base.typed import convert
from biped.measure.seven_links import kind_of
from biped.measure.trajectory import Trajectory
from biped.robot.columns import columns_of
from biped.robot.ground import profile_from
from biped.robot.load import robot_from
from biped.scenario.world import Seat


def trajectory_from(
    about: Mapping[str, Any], log: np.ndarray, inferred: np.ndarray | None = None, seat_force: np.ndarray | None = None,
    account: np.ndarray | None = None, outside: np.ndarray | None = None,
) -> Trajectory:  # fmt: skip
    """The trajectory that `Trajectory.about` and its arrays say.

    Earlier versions wrote two kinds: planar ones with a `tree` beside a description of the robot (the oldest with
    neither name nor description, all of them the human's), and others that said so under `kind`.

    Raises:
        KeyError: Something is missing.
        TypeError: Something is there that is nothing of a trajectory's.
        ValueError: They do not fit.
    """
    about = dict(about)
    about.pop("kind", None)
    about["robot"] = robot_from(about.get("robot"), about.pop("tree", None))
    about["ground"] = profile_from(about.get("ground"))
    about["seat"] = convert(about["seat"], Seat) if "seat" in about else None
    about["pushes"] = tuple(tuple(push) for push in about["pushes"])
    for name in ("gravity", "torque_limit", "signal_names", "changes"):
        about[name] = tuple(about.get(name, ()))
    parts = {"inferred": inferred, "seat_force": seat_force, "account": account, "outside": outside}
    found = kind_of(about["robot"])(log=log, **parts, **about)
    shape = (len(log), found.width + len(found.signal_names))
    if log.shape != shape or log.dtype != np.float64 or len(log) == 0 or not found.tick > 0.0:
        raise ValueError(f"arrays of {log.shape}, {log.dtype}")
    return found


def load(path: Path) -> Trajectory:
    """Reads what `Trajectory.save` wrote.

    Raises:
        InputError: The file is missing or is not a trajectory.
    """
    try:
        with open(path, "rb") as opened, np.load(opened, allow_pickle=False) as file:
            return _loaded(json.loads(str(file["about"])), file)
    except (OSError, EOFError, KeyError, TypeError, ValueError, AttributeError, BadZipFile, MemoryError, zlib.error,
            NotImplementedError, RecursionError, msgspec.ValidationError) as error:  # fmt: skip
        raise InputError(f"{path}: not a trajectory: {why(error)}; remove it to have it simulated again") from None


def _loaded(about: dict[str, Any], arrays: Mapping[str, np.ndarray]) -> Trajectory:
    robot = robot_from(about.get("robot"), about.get("tree"))
    n = len(arrays["time"])
    names = (*columns_of(robot), *(("signals",) if about.get("signal_names") else ()))
    log = np.hstack([np.asarray(arrays[name], dtype=float).reshape(n, -1) for name in names])
    inferred = np.array(arrays["inferred"], dtype=float).reshape(n, 4) if "inferred" in arrays else None
    seat_force = np.array(arrays["seat_force"], dtype=float).reshape(n, 3) if "seat_force" in arrays else None
    account = np.array(arrays["account"], dtype=float).reshape(n) if "account" in arrays else None
    outside = np.array(arrays["outside"], dtype=float).reshape(n, 9) if "outside" in arrays else None
    return trajectory_from(about, log, inferred, seat_force, account, outside)
