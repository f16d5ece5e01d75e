"""Whether Pinocchio, which reads the model file by itself, finds the mass matrix and joints that the tree has."""

from functools import lru_cache
from pathlib import Path

import numpy as np

from biped.base.files import description_of
from biped.base.jit import entry_kernel
from biped.control.agreed import agreed
from biped.control.planar import record
from biped.control.planar.sensing import sense_links
from biped.robot.planar.controller_model import believed_model
from biped.robot.planar.kinematics import mass_matrix
from biped.robot.planar.topology import LINK_DOF, N_LINKS, NQ, X, Z
from biped.robot.planar.tree import Tree

CONFIGURATIONS = 5
"""Random ones at which both have to agree."""
SAME = 1e-12
"""How well, relative to the largest number."""

_Parts = tuple[tuple[bytes, tuple[int, ...]], ...]


def agrees(path: Path, tree: Tree) -> bool:
    """Whether M and joint positions of the tree are Pinocchio's, at a few random configurations of a model file."""
    return _agrees(path, path.stat().st_mtime, tuple((part.tobytes(), part.shape) for part in tree))


@lru_cache(maxsize=8)
def _agrees(path: Path, modified: float, parts: _Parts) -> bool:
    files = path.read_bytes() + description_of(path).read_bytes()
    return agreed(repr(parts).encode() + files, lambda: _refereed(path, parts))


def _refereed(path: Path, parts: _Parts) -> bool:
    import pinocchio

    c = record.new()
    for name, (numbers, shape) in zip(Tree._fields, parts, strict=True):
        c[0]["tree"][name] = np.frombuffer(numbers).reshape(shape)
    model = believed_model(path, 0.0)
    data, M, joint = model.createData(), np.zeros((NQ, NQ)), c[0]["at"]["joint"]
    for q in np.random.default_rng(0).normal(size=(CONFIGURATIONS, NQ)):
        pinocchio.crba(model, data, q, pinocchio.Convention.WORLD)
        _matrices(c, q, np.zeros(NQ), M)
        hinges = data.J[:, LINK_DOF : LINK_DOF + N_LINKS]
        theirs = np.column_stack([-hinges[2] - q[X], hinges[0] - q[Z]])
        for own, other in ((M, np.triu(data.M)), (joint, theirs)):
            if not np.abs(own - other).max() <= SAME * np.abs(other).max():
                return False
    return True


@entry_kernel
def _matrices(record, q, v, M):
    c = record[0]
    sense_links(c, q, v)
    mass_matrix(c["tree"], c["at"], M)
