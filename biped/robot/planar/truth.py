"""How the biped that walks differs from its model file: lengths, masses, inertias, dampers."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from biped.base.errors import InputError
from biped.robot.planar.description import PlanarParts
from biped.robot.planar.topology import BASE, PARENT, POINT_LINK, THIGH, TORSO
from biped.robot.planar.tree import Tree
from biped.scenario.keys import Truth

if TYPE_CHECKING:
    import mujoco


LEAST_INERTIA = 1e-12
"""[kg, kg m²] A link with less cannot be simulated: MuJoCo refuses 1e-15."""


def check_solid(truth: Truth, parts: PlanarParts, tree: Tree) -> None:
    """Makes sure that every link of the biped that walks has a mass and an inertia.

    Raises:
        InputError: One has less than can be simulated.
    """
    true = true_tree(tree, truth)
    for link, mass, inertia in zip(parts.links, true.mass, true.inertia, strict=True):
        if min(mass, inertia) < LEAST_INERTIA:
            raise InputError(
                f"truth: {link}: expected a mass and a moment of inertia of at least {LEAST_INERTIA:g}, got "
                f"{mass:.3g} kg and {inertia:.3g} kg m²", "truth",
            )  # fmt: skip


def true_tree(tree: Tree, truth: Truth) -> Tree:
    """Lengths and masses of the biped that walks, given those of the model file."""
    if truth == Truth():
        return tree
    mass, length = np.array(truth.mass), np.array(truth.length)
    parent = length[list(PARENT)]
    scaled = tree._replace(
        joint=tree.joint * parent[:, None],
        com=tree.com * length[:, None],
        mass=tree.mass * mass,
        inertia=tree.inertia * mass * length**2 * np.array(truth.inertia),
        damping=tree.damping + truth.joint_damping,
        point=tree.point * length[list(POINT_LINK)][:, None],
    )
    return scaled if truth.hip_mass == 0.0 else _with_hip_mass(scaled, truth.hip_mass)


def _with_hip_mass(tree: Tree, hip: float) -> Tree:
    """The tree whose torso carries a point mass [kg] on the hip's axis too."""
    own, at = float(tree.mass[TORSO]), tree.joint[THIGH[0]] - tree.com[TORSO]
    com, mass, inertia = np.array(tree.com), np.array(tree.mass), np.array(tree.inertia)
    mass[TORSO] = own + hip
    com[TORSO] += hip / (own + hip) * at
    inertia[TORSO] += own * hip / (own + hip) * float(at @ at)
    return tree._replace(com=com, mass=mass, inertia=inertia)


def apply_truth(spec: mujoco.MjSpec, truth: Truth, robot: PlanarParts) -> None:
    """Scales masses, inertias and lengths in a parsed model, in place."""
    for i, link in enumerate(robot.links):
        body = spec.body(link)
        length = truth.length[i]
        body.mass *= truth.mass[i]
        body.inertia = body.inertia * (truth.mass[i] * length**2 * truth.inertia[i])
        body.ipos = body.ipos * length
        for part in [*body.sites, *body.geoms, *body.bodies]:
            part.pos = part.pos * length
        for geom in body.geoms:
            geom.fromto = geom.fromto * length
    if truth.hip_mass > 0.0:
        torso, hip = spec.body(robot.base.link), spec.body(robot.leg[0].links[0])
        total = torso.mass + truth.hip_mass
        at = np.array([hip.pos[0], 0.0, hip.pos[2]]) - torso.ipos
        torso.inertia = torso.inertia + torso.mass * truth.hip_mass / total * np.array(
            [at[2] ** 2, at @ at, at[0] ** 2]
        )
        torso.ipos = torso.ipos + truth.hip_mass / total * at
        torso.mass = total
    for joint in robot.joints[BASE:]:
        # MuJoCo 4 keeps a polynomial in the rate: linear, quadratic and cubic coefficient.
        spec.joint(joint).damping = spec.joint(joint).damping + np.array([truth.joint_damping, 0.0, 0.0])
