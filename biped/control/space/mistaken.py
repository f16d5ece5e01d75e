"""A law in space that is mistaken about its robot: joint torques from masses and lengths other than those of the file.

Leg states and Q_d follow from what is sensed, as ever. M, and the Jacobians of the contact points with their J̇v, by
which Q_d becomes torques, are those of the mistaken tree.
"""

import numpy as np

from biped.base.jit import entry_kernel
from biped.control.law import Setup
from biped.control.space.dynamics import compute_mechanics
from biped.control.space.own import Own, own_of
from biped.control.space.places import heights, mass_blocks, point_motion
from biped.control.space.tick import allocate, decide_forces
from biped.scenario.keys import Scenario
from biped.scenario.vary import stream

LEAST = 0.01
"""Of a mass of the file: no body is believed to be lighter."""


def is_mistaken(s: Scenario) -> bool:
    """Whether a scenario asks for mistakes."""
    return s.randomise.controller_mass_matrix > 0.0 or s.randomise.controller_constraints > 0.0


def mistaken_own(c: np.void, setup: Setup, q: np.ndarray, v: np.ndarray) -> Own | None:
    """Mechanics of masses and lengths that are drawn for the run; None where the scenario asks for no mistakes.

    Mass and moments of inertia of a body are multiplied by one factor, the numbers that place it in its parent by one
    each.

    Args:
        c: The controller record.
        setup: The run's.
        q: (nq,) sensed coordinates, live.
        v: (nv,) sensed velocities, live.

    Raises:
        InputError: The model has parts that only MuJoCo computes with.
    """
    if not is_mistaken(setup.scenario):
        return None
    own, random = own_of(c, setup.model, q, v), setup.scenario.randomise
    bodies = own.tree.bodies
    heavier, longer = (
        1.0 + deviation * stream(setup.seed, name).standard_normal(shape)
        for name, deviation, shape in (
            ("controller_mass_matrix", random.controller_mass_matrix, (bodies.size, 1)),
            ("controller_constraints", random.controller_constraints, (bodies.size, 3)),
        )
    )
    heavier = np.maximum(heavier, LEAST)
    bodies["mass"] *= heavier[:, 0]
    bodies["inertia"] *= heavier
    bodies["place"] *= longer
    return own


@entry_kernel
def mistaken_tick(record, m, tree, wrong, first):
    """The law for one tick, as `biped.control.space.tick.spatial_tick`, of a law that is mistaken.

    Args:
        record: (1,) of `biped.control.space.record.control_type`.
        m: `biped.control.space.places.Mechanics` as the file has them.
        tree: `biped.robot.tree.BodyTree` that the law believes in.
        wrong: Mechanics of it.
        first: Whether this is the run's first tick.
    """
    c = record[0]
    decide_forces(c, m, first)
    if c["actuation"]["generalized"] == 0:
        compute_mechanics(tree, wrong)
        mass_blocks(c, wrong)
        heights(c, wrong)
        point_motion(c, wrong)
        heights(c, m)  # those of the ground are sensed
        allocate(c, m, first)
