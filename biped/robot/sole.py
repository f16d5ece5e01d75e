"""Where a foot touches ground: points of its geoms, how far they reach, and the plane on which they rest."""

import math

import mujoco
import numpy as np

FLAT = 0.02
"""[m] above the lowest point of a sole within which a corner belongs to it."""
EVEN = 0.002
"""[m] from the plane on which a sole rests within which a point belongs to it."""
_TIPS = 200
"""Most edges about which a sole tips."""
_STANDS = math.sqrt(0.5)
"""Share of its axis along z from which a cylinder stands on its rim."""
_DIAGONALS = np.array([[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]])
"""Of the ground, along which corners lie."""


def points_of(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> np.ndarray:
    """(k, 3) [m] places in the world of the points of a geom that may touch the ground from above.

    A box has the four corners of its lowest face, a capsule the lowest points of its ends, a sphere or ellipsoid its
    lowest point, a cylinder that stands four points of its lowest rim and one that lies the ends of its lowest line, a
    mesh the outermost four of the vertices that it rests on.
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
            return place + _of_cylinder(turn[:, 2], size[0], size[1])
        case mujoco.mjtGeom.mjGEOM_MESH:
            return _outermost(place + mesh_vertices(model, geom) @ turn.T)
        case mujoco.mjtGeom.mjGEOM_ELLIPSOID:
            local = turn.T @ down
            return (place + turn @ (size**2 * local / np.linalg.norm(size * local)))[None]
        case _:
            return (place + size[0] * down)[None]


def furthest(model: mujoco.MjModel, data: mujoco.MjData, geom: int, way: np.ndarray) -> float:
    """[m] How far a geom reaches along a direction (3,) of the world, of length one."""
    kind, size = mujoco.mjtGeom(model.geom_type[geom]), model.geom_size[geom]
    along = data.geom_xmat[geom].reshape(3, 3).T @ way
    match kind:
        case mujoco.mjtGeom.mjGEOM_BOX:
            reach = float(size @ np.abs(along))
        case mujoco.mjtGeom.mjGEOM_CAPSULE:
            reach = float(size[0] + size[1] * abs(along[2]))
        case mujoco.mjtGeom.mjGEOM_CYLINDER:
            reach = float(size[0] * np.hypot(along[0], along[1]) + size[1] * abs(along[2]))
        case mujoco.mjtGeom.mjGEOM_ELLIPSOID:
            reach = float(np.linalg.norm(size * along))
        case mujoco.mjtGeom.mjGEOM_MESH:
            reach = float((mesh_vertices(model, geom) @ along).max())
        case _:
            reach = float(size[0])
    return float(data.geom_xpos[geom] @ way) + reach


def mesh_vertices(model: mujoco.MjModel, geom: int) -> np.ndarray:
    """(k, 3) [m] vertices of a mesh, in its geom's frame."""
    mesh = model.geom_dataid[geom]
    first, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
    return np.array(model.mesh_vert[first : first + count], dtype=float)


def _of_cylinder(axis: np.ndarray, radius: float, half: float) -> np.ndarray:
    """(k, 3) [m] lowest points of a cylinder from its middle, which do not hang on how it is turned about its axis."""
    if abs(axis[2]) < _STANDS:
        down = axis[2] * axis - np.array([0.0, 0.0, 1.0])
        return radius * down / np.linalg.norm(down) + np.array([half * axis, -half * axis])
    ways = np.column_stack([_DIAGONALS, np.zeros(4)])
    ways = ways - np.outer(ways @ axis, axis)
    out = radius * ways / np.linalg.norm(ways, axis=1)[:, None] - math.copysign(half, axis[2]) * axis
    return out


def _outermost(vertices: np.ndarray) -> np.ndarray:
    """The four vertices furthest out along the diagonals, of those that a mesh rests on, moved into their plane."""
    low = vertices[vertices[:, 2] < vertices[:, 2].min() + FLAT]
    above = height_over_rest(low)
    even = above < EVEN
    low, above = low[even], above[even]
    found = [int(np.argmax(low[:, :2] @ way)) for way in _DIAGONALS]
    chosen = sorted(set(found))
    return low[chosen] - np.column_stack([np.zeros((len(chosen), 2)), above[chosen]])


def height_over_rest(points: np.ndarray) -> np.ndarray:
    """Heights of points over the plane that they rest on when they are pressed onto ground by their middle.

    The plane touches the lowest point first. It then tips towards the middle, about one point and after that about
    edges, until the middle is between three points that it touches.

    Args:
        points: (k, 3) [m], z up.

    Returns:
        (k,) [m] along z, not less than zero; where all lie in a line, over a plane without a slope across it.
    """
    middle = 0.5 * (points[:, :2].min(axis=0) + points[:, :2].max(axis=0))
    size = max(float(np.ptp(points[:, :2], axis=0).max()), 1e-12)
    first = int(np.argmin(points[:, 2]))
    height = points[:, 2] - points[first, 2]
    way = middle - points[first, :2]
    second = _tipped(points[:, :2] - points[first, :2], way, height, size)
    edge = [first] if second is None else [first, second]
    for _ in range(_TIPS if len(edge) == 2 else 0):
        a, b = points[edge[0], :2], points[edge[1], :2]
        across = np.array([a[1] - b[1], b[0] - a[0]])
        across *= np.sign(across @ (middle - a))
        third = _tipped(points[:, :2] - a, across, height, size)
        if third is None:
            break
        others = [(corner, edge[1 - i]) for i, corner in enumerate(edge)]
        beyond = [_beyond(points[[one, third, other], :2], middle) for one, other in others]
        if not any(beyond):
            break
        edge = [others[beyond.index(True)][0], third]
    return np.maximum(height, 0.0)


def _tipped(places: np.ndarray, way: np.ndarray, height: np.ndarray, size: float) -> int | None:
    """Tips the plane up along a way, about where that is zero, to the next point; which one, or None if there is none.

    Args:
        places: (k, 2) [m] from a point of the axis.
        way: (2,) up which it is tipped.
        height: (k,) [m] over the plane, which is changed.
        size: [m] of all points.
    """
    norm = float(np.linalg.norm(way))
    ahead = places @ (way / norm) if norm > 1e-9 * size else np.zeros(len(places))
    there = np.flatnonzero(ahead > 1e-6 * size)
    if not len(there):
        return None
    slopes = height[there] / ahead[there]
    height -= ahead * slopes.min()
    return int(there[np.argmin(slopes)])


def _beyond(corners: np.ndarray, middle: np.ndarray) -> bool:
    """Whether a place is on the other side of the line through the first two corners than the third one."""
    a, b, c = corners
    across = np.array([a[1] - b[1], b[0] - a[0]])
    return bool((across @ (middle - a)) * (across @ (c - a)) < 0.0)
