"""Mass matrix and world-frame Jacobian of the planar tree: Pinocchio's numbers at a tenth of the price of its calls."""

from __future__ import annotations

import math
from functools import lru_cache
from pathlib import Path

import numpy as np
import pinocchio

from biped.base.jit import kernel
from biped.robot.model import believed_model
from biped.robot.tree import Tree

_REFEREED = 5
"""Random configurations at which Pinocchio has to agree."""
_SAME = 1e-12
"""How well, relative to the largest entry."""


@kernel
def tree_matrices(tree, q, M, J):
    """Fills M (9, 9), upper triangle, and the rows 0, 2, 4 of J (6, 9) that a plane has."""
    for i in range(9):
        for j in range(i, 9):
            M[i, j] = 0.0
        J[0, i], J[2, i], J[4, i] = 0.0, 0.0, 0.0
    J[0, 0], J[2, 1] = 1.0, 1.0
    c0, s0 = math.cos(q[2]), math.sin(q[2])
    ox, oz = q[0], q[1]
    _hinge(J, 2, ox, oz)
    x, z = c0 * tree.com[0, 0] - s0 * tree.com[0, 1], s0 * tree.com[0, 0] + c0 * tree.com[0, 1]
    torso_m = tree.mass[0]
    torso_x, torso_z = torso_m * x, torso_m * z
    torso_t = torso_m * (x * x + z * z) + tree.inertia[0]
    for hip in (1, 4):
        a1 = q[2] + q[hip + 2]
        a2 = a1 + q[hip + 3]
        a3 = a2 + q[hip + 4]
        c1, s1, c2, s2, c3, s3 = math.cos(a1), math.sin(a1), math.cos(a2), math.sin(a2), math.cos(a3), math.sin(a3)
        b, com, mass, inertia = tree.joint, tree.com, tree.mass, tree.inertia
        x1, z1 = c0 * b[hip, 0] - s0 * b[hip, 1], s0 * b[hip, 0] + c0 * b[hip, 1]
        x2, z2 = x1 + c1 * b[hip + 1, 0] - s1 * b[hip + 1, 1], z1 + s1 * b[hip + 1, 0] + c1 * b[hip + 1, 1]
        x3, z3 = x2 + c2 * b[hip + 2, 0] - s2 * b[hip + 2, 1], z2 + s2 * b[hip + 2, 0] + c2 * b[hip + 2, 1]
        _hinge(J, hip + 2, ox + x1, oz + z1)
        _hinge(J, hip + 3, ox + x2, oz + z2)
        _hinge(J, hip + 4, ox + x3, oz + z3)
        m, sx, sz, t = 0.0, 0.0, 0.0, 0.0
        for link in (hip + 2, hip + 1, hip):
            if link == hip + 2:
                px, pz, c, s = x3, z3, c3, s3
            elif link == hip + 1:
                px, pz, c, s = x2, z2, c2, s2
            else:
                px, pz, c, s = x1, z1, c1, s1
            x, z = px + c * com[link, 0] - s * com[link, 1], pz + s * com[link, 0] + c * com[link, 1]
            m += mass[link]
            sx += mass[link] * x
            sz += mass[link] * z
            t += mass[link] * (x * x + z * z) + inertia[link]
            j = link + 2
            M[0, j] = m * pz - sz
            M[1, j] = sx - m * px
            M[2, j] = t - sx * px - sz * pz
            M[hip + 2, j] = t - sx * (x1 + px) - sz * (z1 + pz) + m * (x1 * px + z1 * pz)
            if link > hip:
                M[hip + 3, j] = t - sx * (x2 + px) - sz * (z2 + pz) + m * (x2 * px + z2 * pz)
            if link > hip + 1:
                M[hip + 4, j] = t - sx * (x3 + px) - sz * (z3 + pz) + m * (x3 * px + z3 * pz)
        torso_m += m
        torso_x += sx
        torso_z += sz
        torso_t += t
    M[0, 0] = M[1, 1] = torso_m
    M[0, 2], M[1, 2], M[2, 2] = -torso_z, torso_x, torso_t
    for i in range(6):
        M[3 + i, 3 + i] += tree.armature[i]


@kernel
def _hinge(J, j, x, z):
    """A hinge about -y at (x, z)."""
    J[0, j], J[2, j], J[4, j] = z, -x, -1.0


def same_matrices(path: Path, tree: Tree) -> bool:
    """Whether Pinocchio, reading the model file by itself, finds the tree's M and Jacobian at random configurations."""
    return _same_matrices(str(path), path.stat().st_mtime, tuple(array.tobytes() for array in tree))


@lru_cache(maxsize=8)
def _same_matrices(path: str, modified: float, tree: tuple[bytes, ...]) -> bool:
    model = believed_model(Path(path), 0.0)
    data = model.createData()
    arrays = (np.frombuffer(part).reshape(shape) for part, shape in zip(tree, _SHAPES, strict=True))
    M, J, own = np.zeros((9, 9)), np.zeros((6, 9)), Tree(*arrays)
    for q in np.random.default_rng(0).normal(size=(_REFEREED, 9)):
        pinocchio.crba(model, data, q, pinocchio.Convention.WORLD)
        tree_matrices(own, q, M, J)
        for mine, theirs in ((M, np.triu(data.M)), (J, data.J)):
            if not np.abs(mine - theirs).max() <= _SAME * np.abs(theirs).max():
                return False
    return True


_SHAPES = ((7, 2), (7, 2), (7,), (7,), (6,), (6,), (4, 2))
