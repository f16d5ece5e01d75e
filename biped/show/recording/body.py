"""The biped as its model file draws it: shapes once, then the pose of every body at the picture rate."""

import mujoco
import numpy as np
import rerun as rr

from biped.robot.assets import DRAWN
from biped.show.recording.recorded import Placed, times

PICTURES = 60.0
"""[Hz]"""
_DEFAULT_COLOUR = np.array([0.5, 0.5, 0.5, 1.0], np.float32)
_GHOST = (150, 150, 155, 70)


def log_body(recording: rr.RecordingStream, placed: Placed, rows: np.ndarray) -> None:
    """Logs shapes and their motion.

    Args:
        recording: Where to.
        placed: The run.
        rows: (m,) rows of the trajectory to show.
    """
    model, trajectory = placed.run.model, placed.run.trajectory
    shown = drawn_geoms(model)
    bodies = sorted({int(model.geom_bodyid[g]) for g in shown})
    for geom in shown:
        path = placed.entity("scene", "body", model.body(model.geom_bodyid[geom]).name, f"shape_{geom}")
        recording.log(path, _shape(model, geom, placed.run.ghost), static=True)
    position, quaternion = body_poses(model, trajectory.qpos(model)[rows])
    at = times(trajectory.time[rows])
    for body in bodies:
        recording.send_columns(
            placed.entity("scene", "body", model.body(body).name),
            indexes=[at],
            columns=rr.Transform3D.columns(
                translation=position[:, body].astype(np.float32),
                quaternion=np.roll(quaternion[:, body], -1, axis=-1).astype(np.float32),  # w last
            ),
        )


def drawn_geoms(model: mujoco.MjModel) -> list[int]:
    """Numbers of the geoms that are drawn, the world's excepted: `scene` draws the ground."""
    return [g for g in range(model.ngeom) if model.geom_bodyid[g] > 0 and model.geom_group[g] <= DRAWN]


def mass_centres(model: mujoco.MjModel, q: np.ndarray, body: str) -> np.ndarray:
    """(m, 3) [m] the centre of mass of a body in configurations q (m, nq), in the model's order."""
    data, number = mujoco.MjData(model), model.body(body).id
    out = np.empty((len(q), 3))
    for i, row in enumerate(q):
        data.qpos[:] = row
        mujoco.mj_kinematics(model, data)
        out[i] = data.xipos[number]
    return out


def body_poses(model: mujoco.MjModel, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions (m, nbody, 3) [m] and quaternions (m, nbody, 4), w first, of all bodies."""
    data = mujoco.MjData(model)
    position, quaternion = np.empty((len(q), model.nbody, 3)), np.empty((len(q), model.nbody, 4))
    for i, row in enumerate(q):
        data.qpos[:] = row
        mujoco.mj_kinematics(model, data)
        position[i], quaternion[i] = data.xpos, data.xquat
    return position, quaternion


def _shape(model: mujoco.MjModel, geom: int, ghost: bool) -> rr.AsComponents:
    """A geom in its body's frame."""
    kind, size = mujoco.mjtGeom(model.geom_type[geom]), model.geom_size[geom]
    centre, quaternion = model.geom_pos[geom], model.geom_quat[geom]
    turned = np.roll(quaternion, -1)
    colour = _GHOST if ghost else _colour(model, geom)
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, quaternion)
    turn = turn.reshape(3, 3)
    solid = rr.components.FillMode.Solid
    match kind:
        case mujoco.mjtGeom.mjGEOM_CAPSULE:  # rerun's starts at its origin, MuJoCo's is centred
            return rr.Capsules3D(
                lengths=2.0 * size[1], radii=size[0], translations=centre - turn[:, 2] * size[1],
                quaternions=turned, colors=colour, fill_mode=solid,
            )  # fmt: skip
        case mujoco.mjtGeom.mjGEOM_CYLINDER:
            return rr.Cylinders3D(
                lengths=2.0 * size[1], radii=size[0], centers=centre, quaternions=turned, colors=colour,
                fill_mode=solid,
            )  # fmt: skip
        case mujoco.mjtGeom.mjGEOM_BOX:
            return rr.Boxes3D(half_sizes=size, centers=centre, quaternions=turned, colors=colour, fill_mode=solid)
        case mujoco.mjtGeom.mjGEOM_MESH:
            mesh = model.mesh(model.geom_dataid[geom])
            first, count = int(mesh.vertadr[0]), int(mesh.vertnum[0])
            face, faces = int(mesh.faceadr[0]), int(mesh.facenum[0])
            return rr.Mesh3D(
                vertex_positions=model.mesh_vert[first : first + count] @ turn.T + centre,
                triangle_indices=model.mesh_face[face : face + faces],
                albedo_factor=colour,
            )
    half = np.full(3, size[0]) if kind == mujoco.mjtGeom.mjGEOM_SPHERE else size
    return rr.Ellipsoids3D(half_sizes=half, centers=centre, quaternions=turned, colors=colour, fill_mode=solid)


def _colour(model: mujoco.MjModel, geom: int) -> np.ndarray:
    """RGBA (4,) as MuJoCo shows it: a material counts unless the geom has a colour of its own."""
    rgba, material = model.geom_rgba[geom], model.geom_matid[geom]
    if material >= 0 and np.array_equal(rgba, _DEFAULT_COLOUR):
        rgba = model.mat_rgba[material]
    return np.round(255.0 * rgba).astype(np.uint8)
