"""Results in EuroBench's formats: pre-processed data of every run as CSV and YAML, one YAML file an indicator.

Format as in EuroBench's documents (github.com/aremazeilles/eurobench_documentation, data_format.adoc and pi_spec.adoc;
indicators as in github.com/eurobench/eb_hum_bench); nobody has certified anything. Its frame is ISB's: x in the
direction of gait, y vertical and up, z to the right; so angles about z are anticlockwise seen from the right, as here.
"""

import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from biped.base.errors import InputError
from biped.base.writing import write_text
from biped.measure.indicators import Indicator, gait_events, gait_parameters, of_campaign, of_run
from biped.measure.metrics.pushed import impulses
from biped.measure.signals import end_forces, toes_and_heels
from biped.measure.trajectory import Trajectory
from biped.robot.planar.topology import ENDS, LEGS
from biped.scenario.keys import Scenario
from biped.show.results_folder import ResultsFolder
from biped.studies.folders import writing

JOINTS = tuple(f"{side}_{joint}" for side in "rl" for joint in ("hip", "knee", "ankle"))
"""EuroBench's labels of the six joints, in canonical order: right leg, then left."""
_PI = "performance_indicators"


def export(folder: Path, out: Path) -> list[Path]:
    """Writes a results folder in EuroBench's formats; returns the files.

    A single run's files are called by their type alone; those of several runs begin with `run_Z_`, those of a sweep
    with `cond_Y_run_Z_`, with a `condition_Y.yaml` for each of its points. Indicators lie in a folder of their own.

    Args:
        folder: The results folder.
        out: Where; it must not exist, or be empty.

    Raises:
        InputError: There is no such result, its runs cannot be had, or something is in the way.
    """
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise InputError(f"--eurobench {out}: already holds something; expected a new folder")
    kept = ResultsFolder(folder)
    rows, plan = kept.result["runs"], kept.plan
    runs, points = plan.scenario.randomise.runs, len(plan.points)
    files: list[Path] = []

    def write(name: str, text: str) -> None:
        path = out / name
        path.parent.mkdir(parents=True, exist_ok=True)
        write_text(path, text)
        files.append(path)

    pushes: dict[int, float] = {}
    with writing(f"--eurobench {out}", "choose another folder"):
        for row in rows:
            t = kept.trajectory(row["index"])
            if t is None:
                raise InputError(kept.again(row["index"]))
            prefix = _prefix(row["index"], len(rows), runs, points)
            for name, text in _of_run(t).items():
                write(f"{prefix}{name}", text)
            for name, indicator in of_run(t).items():
                write(f"{_PI}/{prefix}{name}.yaml", _indicator(indicator))
            strongest = max((abs(push.size) for push in impulses(t)), default=0.0)
            if strongest > 0.0:
                pushes[row["index"]] = strongest
        for point in range(points):
            name = "condition.yaml" if points == 1 else f"condition_{point + 1:0{len(str(points))}d}.yaml"
            write(name, _yaml(_condition(plan.run(point * runs).scenario, plan.points[point])))
        if len(rows) > 1:
            for name, indicator in of_campaign(kept.result, pushes).items():
                write(f"{_PI}/{name}.yaml", _indicator(indicator))
    return files


def _prefix(index: int, rows: int, runs: int, points: int) -> str:
    """The context of a file's name: condition and run, counted from 1."""
    if rows == 1:
        return ""
    point, number = divmod(index, runs)
    run = f"run_{number + 1:0{len(str(runs))}d}_"
    return run if points == 1 else f"cond_{point + 1:0{len(str(points))}d}_{run}"


def _of_run(t: Trajectory) -> dict[str, str]:
    """The files of one run: name to text."""
    force, feet = (each(t)[..., [0, 2]].reshape(len(t), LEGS, ENDS, 2) for each in (end_forces, toes_and_heels))
    torques = t.joint_torques
    files = {
        "jointStates.csv": _csv(t, _interleaved(JOINTS, {"pos": t.joint_angles, "vel": t.joint_rates})),
        "jointTorques.csv": _csv(t, {f"{joint}_z": torques[:, i] for i, joint in enumerate(JOINTS)}),
        "com.csv": _csv(t, _com(t)),
        "grf.csv": _csv(t, _wrench(t, force.sum(axis=1), force, feet)),
        "gaitEvents.yaml": _yaml(gait_events(t)),
        "gaitParameters.yaml": _yaml(gait_parameters(t)),
    }
    for leg, side in enumerate(("right", "left")):
        part = slice(leg, leg + 1)
        files[f"grf_{side}.csv"] = _csv(t, _wrench(t, force[:, leg], force[:, part], feet[:, part]))
    return files


def _interleaved(labels: Sequence[str], parts: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    return {f"{label}_{part}": values[:, i] for i, label in enumerate(labels) for part, values in parts.items()}


def _upright(t: Trajectory, vectors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Vectors (…, 2) along and normal to the ground as horizontal and vertical."""
    c, s = math.cos(math.radians(t.slope)), math.sin(math.radians(t.slope))
    return c * vectors[..., 0] - s * vectors[..., 1], s * vectors[..., 0] + c * vectors[..., 1]


def _com(t: Trajectory) -> dict[str, np.ndarray]:
    x, y = _upright(t, t.com[:, [0, 2]])
    vx, vy = _upright(t, t.com_velocity[:, [0, 2]])
    none = np.zeros(len(t))
    return {"x": x, "y": y, "z": none, "vel_x": vx, "vel_y": vy, "vel_z": none}


def _wrench(t: Trajectory, total: np.ndarray, force: np.ndarray, feet: np.ndarray) -> dict[str, np.ndarray]:
    """Force (n, …, 2, 2) of feet and its centre of pressure; where nothing is loaded that is the feet's middle."""
    normal = force[..., 1].reshape(len(t), -1)
    points = feet.reshape(len(t), -1, 2)
    middle = points.mean(axis=1)
    load = normal.sum(axis=1)
    total = total.reshape(len(t), -1, 2).sum(axis=1)
    along = np.where(load > 1.0, (normal * points[..., 0]).sum(axis=1) / np.maximum(load, 1.0), middle[:, 0])
    place = np.column_stack([along, np.zeros(len(t))])
    (fx, fy), (px, py) = _upright(t, total), _upright(t, place)
    none = np.zeros(len(t))
    return {"f_x": fx, "f_y": fy, "f_z": none, "p_x": px, "p_y": py, "p_z": none}


def _condition(s: Scenario, values: Mapping[str, Any]) -> dict[str, Any]:
    """Description of the experiment, and its controlled variables: those that a sweep changes."""
    out: dict[str, Any] = {
        "model": Path(s.model).name, "controller": Path(s.controller).name, "engine": s.engine,
        "duration": s.duration, "slope_angle": s.ground.slope, "ground_friction": s.ground.friction,
        "control_rate": s.simulation.control_rate, "start_posture": s.start.posture, "start_jitter": s.start.jitter,
        "number_of_pushes": len(s.push),
    }  # fmt: skip
    for i, push in enumerate(s.push):
        out |= {
            f"push_{i + 1}_body": push.body, f"push_{i + 1}_start": push.at, f"push_{i + 1}_duration": push.duration,
            f"push_{i + 1}_force": list(push.force),
        }  # fmt: skip
        if push.shape != "constant":
            out[f"push_{i + 1}_shape"] = push.shape
        if push.shape == "sine":
            out[f"push_{i + 1}_frequency"] = push.frequency
    for name, size in (("tile_height", s.ground.tiles.height), ("step_rise", s.ground.steps.rise)):
        if size != 0.0:
            out[name] = size
    return out | {re.sub(r"\W+", "_", key).lower(): _plain(value) for key, value in values.items()}


def _plain(value: Any) -> Any:
    return list(value) if isinstance(value, tuple) else value


def _csv(t: Trajectory, columns: Mapping[str, np.ndarray]) -> str:
    """A time series: labels, then a line per tick, semicolons between."""
    table = np.column_stack([t.time, *columns.values()])
    lines = ["; ".join(["time", *columns])]
    lines += ["; ".join(f"{value:.9g}" for value in row) for row in table]
    return "\n".join(lines) + "\n"


def _indicator(indicator: Indicator) -> str:
    if isinstance(indicator.value, float):
        return _yaml({"type": "scalar", "value": indicator.value})
    label = {"label": list(indicator.label)} if indicator.label else {}
    return _yaml({"type": "vector", **label, "value": indicator.value})


def _yaml(values: Mapping[str, Any]) -> str:
    """Lines `key: value`; what needs no more than numbers, words and lists of them."""
    return "".join(f"{key}: {_scalar(value)}\n" for key, value in values.items())


def _scalar(value: Any) -> str:
    if isinstance(value, list):
        return f"[{', '.join(_scalar(one) for one in value)}]"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return f"{value:.9g}" if math.isfinite(value) else ".nan"
    if isinstance(value, int):
        return str(value)
    text = str(value)
    return text if re.fullmatch(r"[A-Za-z][\w ./+-]*", text) else "'" + text.replace("'", "''") + "'"
