"""Where a foot touches: points of its geoms that are lowest in a posture, fixed to the body from then on."""

import mujoco
import numpy as np

FLAT = 0.02
"""[m] above the lowest point of a sole within which a corner belongs to it."""


def points_of(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> np.ndarray:
    """(k, 3) [m] places in the world of the points of a geom that may touch the ground from above.

    A box has the four corners of its lowest face, a capsule the lowest points of its ends, a sphere or ellipsoid its
    lowest point,
    a cylinder four points of its lowest rim, a mesh the outermost four of its lowest vertices.
    """
    kind, size = mujoco.mjtGeom(model.geom_type[geom]), model.geom_size[geom]
    place, turn = data.geom_xpos[geom], data.geom_xmat[geom].reshape(3, 3)
    down = np.array([0.0, 0.0, -1.0])
    match kind:
        case mujoco.mjtGeom.mjGEOM_BOX:
            signs = np.array([[x, y, z] for x in (1, -1) for y in (1, -1) for z in (1, -1)])
            lower = int(np.argmax(np.abs(turn[2])))  # the face that lies lowest, however tilted its edges
            below = signs[:, lower] == (-1.0 if turn[2, lower] > 0.0 else 1.0)
            return place + (signs[below] * size) @ turn.T
        case mujoco.mjtGeom.mjGEOM_CAPSULE:
            ends = np.array([[0.0, 0.0, size[1]], [0.0, 0.0, -size[1]]])
            return place + ends @ turn.T + size[0] * down
        case mujoco.mjtGeom.mjGEOM_CYLINDER:
            rim = [[x, y, z] for x, y in ((1, 0), (0, 1), (-1, 0), (0, -1)) for z in (1, -1)]
            return _lowest(place + (np.array(rim) * [size[0], size[0], size[1]]) @ turn.T)
        case mujoco.mjtGeom.mjGEOM_MESH:
            mesh = model.geom_dataid[geom]
            first, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
            return _outermost(place + model.mesh_vert[first : first + count].astype(float) @ turn.T)
        case mujoco.mjtGeom.mjGEOM_ELLIPSOID:
            local = turn.T @ down
            return (place + turn @ (size**2 * local / np.linalg.norm(size * local)))[None]
        case _:
            return (place + size[0] * down)[None]


def _lowest(corners: np.ndarray) -> np.ndarray:
    """The lower half of corners (2 k, 3), in their order."""
    return corners[np.sort(np.argsort(corners[:, 2], kind="stable")[: len(corners) // 2])]


def _outermost(vertices: np.ndarray) -> np.ndarray:
    """The four vertices furthest out along the diagonals, of those that are about as low as the lowest."""
    low = vertices[vertices[:, 2] < vertices[:, 2].min() + FLAT]
    found = [int(np.argmax(low[:, :2] @ way)) for way in np.array([[1, 1], [1, -1], [-1, 1], [-1, -1]])]
    return low[sorted(set(found))]


def pairs_of(model: mujoco.MjModel) -> set[frozenset[int]]:
    """Geoms that the file says meet."""
    return {frozenset((int(model.pair_geom1[i]), int(model.pair_geom2[i]))) for i in range(model.npair)}


def touches(model: mujoco.MjModel, pairs: set[frozenset[int]], geom: int, ground: int) -> bool:
    """Whether a geom meets the ground, by what it is or as one of the file's pairs."""
    a, b = (model.geom_contype[geom], model.geom_conaffinity[geom]), (
        model.geom_contype[ground], model.geom_conaffinity[ground])  # fmt: skip
    return bool(a[0] & b[1] or b[0] & a[1]) or frozenset((geom, ground)) in pairs
