"""Seven links in a plane as data: names and numbers of their parts in canonical order, for the compiled code."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from biped.base.typed import convert
from biped.robot.planar.description import PlanarParts
from biped.robot.planar.tree import Tree

Pair = tuple[float, float]


class SevenLinks(PlanarParts, frozen=True, kw_only=True, dict=True):
    """A torso with two legs of three links.

    Attributes:
        joint: [m] position of each link's joint in its parent's frame.
        com: [m] centre of mass of each link.
        mass: [kg] of each link.
        inertia: [kg m²] of each link about its centre of mass.
        armature: [kg m²] reflected actuator inertia of hip, knee, ankle; leg by leg.
        damping: [N m s/rad] viscous damping of the same joints.
        point: [m] toe and heel of each foot.
    """

    joint: tuple[Pair, ...]
    com: tuple[Pair, ...]
    mass: tuple[float, ...]
    inertia: tuple[float, ...]
    armature: tuple[float, ...]
    damping: tuple[float, ...]
    point: tuple[Pair, ...]

    @cached_property
    def tree(self) -> Tree:
        """The numbers as arrays, which are not to be written to."""
        return Tree(**{name: np.array(getattr(self, name), dtype=float) for name in Tree._fields})


def seven_links_of(parts: PlanarParts, tree: Tree) -> SevenLinks:
    """The seven links of these names and these numbers."""
    numbers = {name: value.tolist() for name, value in tree._asdict().items()}
    named = {name: getattr(parts, name) for name in PlanarParts.__struct_fields__}
    return convert(named | numbers, SevenLinks)
