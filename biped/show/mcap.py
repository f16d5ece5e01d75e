"""A run as an MCAP file for Foxglove and PlotJuggler: every curve of the recording, the robot's body and its forces.

Messages are JSON. What is drawn follows Foxglove's schemas by their names (github.com/foxglove/foxglove-sdk); curves
are objects of numbers, one topic for each plot.
"""

import json
from collections.abc import Iterator, Mapping
from io import BytesIO
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from biped.base.errors import InputError
from biped.base.writing import Kind, may_write, written
from biped.measure.signals import end_forces, every, toes_and_heels
from biped.robot.ground import GRAVITY
from biped.show import spatial
from biped.show.recording import series
from biped.show.recording.scene import PICTURES, body_poses, drawn_geoms
from biped.show.recording.series import Placed, Recorded, place
from biped.show.results_folder import run_of
from biped.studies.folders import writing

KIND = Kind("an MCAP file", (".mcap",), (b"\x89MCAP0\r\n",))
RATE = 200.0
"""[Hz] of curves: means over the ticks between."""
_FAR, _HIGH = 5.0, 0.02
_ARROW = 0.6
"""[m] of a force of one body weight."""
_GREEN, _GREY = {"r": 0.0, "g": 0.62, "b": 0.45, "a": 1.0}, {"r": 0.7, "g": 0.72, "b": 0.7, "a": 1.0}
_ROOT = "ground"


def export(folder: Path, out: Path, only: int | None = None) -> int:
    """Writes a run of a results folder as MCAP.

    Args:
        folder: The results folder.
        out: The file, *.mcap; an MCAP file that is there is replaced, anything else is not.
        only: Number of the run, where there are several; default: the walker of median speed.

    Returns:
        The number of messages.

    Raises:
        InputError: There is no such run, the package `mcap` is missing, or the file cannot be written.
    """
    may_write(out, "--mcap", KIND)
    try:
        from mcap.writer import CompressionType, Writer
    except ImportError:
        raise InputError("--mcap: needs the package mcap; install it: pip install mcap") from None
    name, trajectory, model = run_of(folder, only)
    run = place([Recorded(name, trajectory, model, {}, (), "")])[0]
    whole = BytesIO()
    writer = Writer(whole, compression=CompressionType.ZSTD)
    writer.start(profile="", library="biped")
    count = _write(writer, run)
    writer.finish()
    with writing(f"--mcap {out}"), written(out) as part:
        part.write_bytes(whole.getvalue())
    return count


def _write(writer: Any, run: Placed) -> int:
    channels: dict[str, int] = {}
    messages = sorted(_messages(run), key=lambda message: message[0])
    for number, (nanoseconds, topic, schema, data) in enumerate(messages):
        if topic not in channels:
            kind = writer.register_schema(schema, "jsonschema", json.dumps(_schema(schema, data)).encode())
            channels[topic] = writer.register_channel(topic, "json", kind)
        writer.add_message(channels[topic], nanoseconds, json.dumps(data).encode(), nanoseconds, number)
    return len(messages)


Message = tuple[int, str, str, Mapping[str, Any]]
"""[ns], topic, schema, and what it says."""


def _messages(run: Placed) -> Iterator[Message]:
    t = run.run.trajectory
    yield from _curves(run)
    rows = every(t, PICTURES)
    times = _nanoseconds(t.time[rows])
    yield times[0], "/body", "foxglove.SceneUpdate", _body(run.run.model, times[0])
    yield from _moving(t, run.run.model, rows, times)


def _nanoseconds(seconds: np.ndarray) -> list[int]:
    return [round(value) for value in (1e9 * seconds).tolist()]


def _curves(run: Placed) -> Iterator[Message]:
    t = run.run.trajectory
    rows = every(t, series.RATE)
    stride = max(1, round(1.0 / (RATE * t.tick * (rows[1] if len(rows) > 1 else 1))))
    for plot in series.curves(run):
        times, values = t.time[rows], plot.values
        count = len(values) // stride * stride
        if not count:
            continue
        mean = values[:count].reshape(-1, stride, values.shape[1]).mean(axis=1)
        fields = [name.replace(" ", "_") for name in plot.names]
        for at, row in zip(_nanoseconds(times[:count:stride]), mean, strict=True):
            if np.isfinite(row).all():
                yield at, f"/{plot.entity}", f"biped.{plot.entity}", dict(zip(fields, row.tolist(), strict=True))


def _stamp(nanoseconds: int) -> dict[str, int]:
    return {"sec": nanoseconds // 10**9, "nsec": nanoseconds % 10**9}


def _xyz(values: Any) -> dict[str, float]:
    return dict(zip("xyz", (float(value) for value in values), strict=True))


def _pose(place: Any, quaternion: Any = (1.0, 0.0, 0.0, 0.0)) -> dict[str, Any]:
    """A pose as Foxglove has it; quaternion w first."""
    w, x, y, z = (float(value) for value in quaternion)
    return {"position": _xyz(place), "orientation": {"x": x, "y": y, "z": z, "w": w}}


def _entity(at: int, frame: str, name: str, **primitives: Any) -> dict[str, Any]:
    empty = {kind: [] for kind in ("arrows", "cubes", "spheres", "cylinders", "lines", "triangles", "texts", "models")}
    return {"timestamp": _stamp(at), "frame_id": frame, "id": name, "lifetime": _stamp(0), "frame_locked": True,
            "metadata": [], **empty, **primitives}  # fmt: skip


def _body(model: mujoco.MjModel, at: int) -> dict[str, Any]:
    """Shapes of all bodies, in their own frames, and the ground."""
    floor = {"pose": _pose((0.0, 0.0, -0.5 * _HIGH)), "size": _xyz((4.0 * _FAR, 2.0, _HIGH)), "color": _GREY}
    entities = [_entity(at, _ROOT, _ROOT, cubes=[floor])]
    for geom in drawn_geoms(model):
        body = model.body(model.geom_bodyid[geom]).name
        entities.append(_entity(at, body, f"{body} {geom}", **_shape(model, geom)))
    return {"deletions": [], "entities": entities}


def _shape(model: mujoco.MjModel, geom: int) -> dict[str, Any]:
    size, centre, turn = model.geom_size[geom], model.geom_pos[geom], model.geom_quat[geom]
    colour = dict(zip("rgba", (float(value) for value in model.geom_rgba[geom]), strict=True))
    pose, types = _pose(centre, turn), mujoco.mjtGeom
    match types(model.geom_type[geom]):
        case types.mjGEOM_CAPSULE | types.mjGEOM_CYLINDER as kind:
            pipe = {"pose": pose, "size": _xyz((2 * size[0], 2 * size[0], 2 * size[1])), "color": colour,
                    "bottom_scale": 1.0, "top_scale": 1.0}  # fmt: skip
            if kind == types.mjGEOM_CYLINDER:
                return {"cylinders": [pipe]}
            axis = np.zeros(3)
            mujoco.mju_rotVecQuat(axis, np.array([0.0, 0.0, size[1]]), turn)
            caps = [{"pose": _pose(centre + end * axis), "size": _xyz([2 * size[0]] * 3), "color": colour}
                    for end in (-1.0, 1.0)]  # fmt: skip
            return {"cylinders": [pipe], "spheres": caps}
        case types.mjGEOM_BOX:
            return {"cubes": [{"pose": pose, "size": _xyz(2 * size), "color": colour}]}
        case types.mjGEOM_MESH:
            mesh = model.mesh(model.geom_dataid[geom])
            vertex, face = int(mesh.vertadr[0]), int(mesh.faceadr[0])
            points = model.mesh_vert[vertex : vertex + int(mesh.vertnum[0])]
            corners = model.mesh_face[face : face + int(mesh.facenum[0])].ravel()
            return {"triangles": [{"pose": pose, "points": [_xyz(point) for point in points], "color": colour,
                                   "colors": [], "indices": corners.tolist()}]}  # fmt: skip
    wide = [2 * size[0]] * 3 if model.geom_type[geom] == types.mjGEOM_SPHERE else 2 * size
    return {"spheres": [{"pose": pose, "size": _xyz(wide), "color": colour}]}


def _moving(t: Any, model: mujoco.MjModel, rows: np.ndarray, times: list[int]) -> Iterator[Message]:
    """Frames of all bodies, and ground forces as arrows; in the frame of the ground, which may slope."""
    position, quaternion = body_poses(model, t.qpos(model)[rows])
    bodies = sorted({int(model.geom_bodyid[geom]) for geom in drawn_geoms(model)})
    point, force = toes_and_heels(t)[rows], end_forces(t)[rows] * _ARROW / (t.mass * GRAVITY)
    upright = np.zeros(4)
    mujoco.mju_mat2Quat(upright, spatial.tilt(t).ravel())
    for i, at in enumerate(times):
        frames = [{"timestamp": _stamp(at), "parent_frame_id": "world", "child_frame_id": _ROOT,
                   "translation": _xyz((0, 0, 0)), "rotation": _pose((0, 0, 0), upright)["orientation"]}]  # fmt: skip
        for body in bodies:
            pose = _pose(position[i, body], quaternion[i, body])
            frames.append({"timestamp": _stamp(at), "parent_frame_id": _ROOT, "child_frame_id": model.body(body).name,
                           "translation": pose["position"], "rotation": pose["orientation"]})  # fmt: skip
        yield at, "/tf", "foxglove.FrameTransforms", {"transforms": frames}
        arrows = [
            _arrow(place, way) for place, way in zip(point[i], force[i], strict=True) if np.linalg.norm(way) > 1e-3
        ]
        yield at, "/ground_forces", "foxglove.SceneUpdate", {
            "deletions": [], "entities": [_entity(at, _ROOT, "ground forces", arrows=arrows)],
        }  # fmt: skip


def _arrow(place: np.ndarray, way: np.ndarray) -> dict[str, Any]:
    """An arrow from a point: Foxglove's point along x."""
    long = float(np.linalg.norm(way))
    turn = np.array([long + way[0], 0.0, -way[2], way[1]])  # half way between x and the force
    turn = turn / np.linalg.norm(turn) if np.linalg.norm(turn) > 1e-12 else np.array([0.0, 0.0, 0.0, 1.0])
    return {"pose": _pose(place, turn), "shaft_length": 0.85 * long, "shaft_diameter": 0.02,
            "head_length": 0.15 * long, "head_diameter": 0.05, "color": _GREEN}  # fmt: skip


def _schema(name: str, data: Mapping[str, Any]) -> dict[str, Any]:
    """A JSON schema of messages: curves are numbers; Foxglove knows its own by their names."""
    fields = {key: {"type": "number"} if isinstance(value, float) else {"type": "array"} for key, value in data.items()}
    return {"title": name, "type": "object", "properties": fields}
