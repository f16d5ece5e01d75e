"""Whether Pinocchio, which reads the model file by itself, finds the mass matrix and joints that the tree has."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from biped.base.files import description_of
from biped.base.jit import entry_kernel
from biped.control.agreed import agreed
from biped.control.planar import record
from biped.control.planar.sensing import sense_links
from biped.robot.planar.kinematics import mass_matrix
from biped.robot.planar.topology import LINK_DOF, N_LINKS, NQ, X, Z
from biped.robot.planar.tree import Tree
from biped.robot.run import Run

if TYPE_CHECKING:
    import pinocchio

CONFIGURATIONS = 5
"""Random ones at which both have to agree."""
SAME = 1e-12
"""How well, relative to the largest number."""


@dataclass(frozen=True)
class _Question:
    """The question of a run's model file, in one version, and a tree."""

    path: Path
    modified: float
    parts: tuple[tuple[bytes, tuple[int, ...]], ...]
    run: Run = field(compare=False)
    tree: Tree = field(compare=False)


def agrees(run: Run, tree: Tree) -> bool:
    """Whether M and joint positions of the tree are Pinocchio's, at a few random configurations of a run's model."""
    parts = tuple((part.tobytes(), part.shape) for part in tree)
    return _agrees(_Question(run.model, run.model.stat().st_mtime, parts, run, tree))


@lru_cache(maxsize=8)
def _agrees(question: _Question) -> bool:
    files = question.path.read_bytes() + description_of(question.path).read_bytes()
    known = repr(question.parts).encode() + files
    return agreed(known, lambda: _refereed(question.run.believed_model, question.tree))


def _refereed(model: pinocchio.Model, tree: Tree) -> bool:
    import pinocchio

    c = record.new()
    for name, part in tree._asdict().items():
        c[0]["tree"][name] = part
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
