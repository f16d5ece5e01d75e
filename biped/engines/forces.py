"""Forces of the ground, as MuJoCo's solver found them, on the contact points that are nearest to where they act."""

from typing import NamedTuple

import mujoco
import numpy as np

from biped.base.jit import inner_kernel, kernel
from biped.robot.robot import Robot


class Contacts(NamedTuple):
    """MuJoCo's contacts; a step's are new arrays, the last two apart.

    Attributes:
        geoms: (n, 2) numbers of geoms.
        place: (n, 3) [m].
        gap: (n,) [m] between the geoms.
        margin: (n,) [m] within which they push each other.
        is_ground: (ngeom,) whether a geom is ground.
        foot: (ngeom,) number of the foot that a geom belongs to, -1 if none.
    """

    geoms: np.ndarray
    place: np.ndarray
    gap: np.ndarray
    margin: np.ndarray
    is_ground: np.ndarray
    foot: np.ndarray


class Solved(NamedTuple):
    """The solver's forces in the contacts.

    Attributes:
        force: (nefc,) of constraint rows.
        row: (n,) first row of each contact; -1 where it has none.
        size: (n,) number of its directions.
        axes: (n, 9) its frame: normal from the first geom to the second, then two tangents.
        friction: (n, 5) its coefficients.
    """

    force: np.ndarray
    row: np.ndarray
    size: np.ndarray
    axes: np.ndarray
    friction: np.ndarray


class GroundContacts:
    """Reads contacts with the ground.

    Args:
        model: What is stepped.
        data: Its state.
        robot: What it is.
        planes: Numbers of the geoms that are ground, where it is not level.

    Attributes:
        pyramidal: Whether friction cones are pyramids.
        is_ground: (ngeom,) whether a geom is ground.
        foot: (ngeom,) number of the foot that a geom belongs to, -1 if none.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, robot: Robot, planes: np.ndarray | None = None):
        self._data = data
        self.is_ground = np.zeros(model.ngeom, dtype=bool)
        self.is_ground[robot.ground if planes is None else planes] = True
        of_body = np.full(model.nbody, -1)
        for number, foot in enumerate(robot.feet):
            # Where the ground is not level geoms have other numbers than in the file.
            on = foot.bodies if planes is not None else [model.geom_bodyid[geom] for geom in foot.geoms]
            of_body[list(on)] = number
        self.foot = of_body[model.geom_bodyid]
        self.pyramidal = model.opt.cone == mujoco.mjtCone.mjCONE_PYRAMIDAL

    def examples(self) -> tuple[Contacts, Solved]:
        """Both for compiling, with arrays that are laid out as MuJoCo's are: with gaps between their rows."""
        number, apart = np.zeros((2, 4), np.int32)[:, ::2], np.zeros((2, 4))[:, ::2]
        contacts = Contacts(number, apart, apart[:, 0], apart[:, 0], self.is_ground, self.foot)
        return contacts, Solved(np.zeros(2), number[:, 0], number[:, 0], apart, apart)

    def now(self) -> Contacts:
        """The contacts that there are."""
        contact = self._data.contact
        return Contacts(contact.geom, contact.pos, contact.dist, contact.includemargin, self.is_ground, self.foot)

    def solved(self) -> Solved:
        """Their forces, after a step."""
        data, contact = self._data, self._data.contact
        return Solved(data.efc_force, contact.efc_address, contact.dim, contact.frame, contact.friction)


@inner_kernel
def nearest_point(points, feet, contacts, c):
    """Number of the contact point that is nearest to contact c of its foot with the ground; -1 of any other contact.

    Args:
        points: (P, 3) [m].
        feet: (P,) their feet.
        contacts: `Contacts`.
        c: Number of the contact.
    """
    first, second = contacts.geoms[c, 0], contacts.geoms[c, 1]
    if contacts.is_ground[first]:
        foot = contacts.foot[second]
    elif contacts.is_ground[second]:
        foot = contacts.foot[first]
    else:
        foot = -1
    out, least = -1, np.inf
    for p in range(feet.size if foot >= 0 else 0):
        if feet[p] == foot:
            x, y, z = (contacts.place[c, 0] - points[p, 0], contacts.place[c, 1] - points[p, 1],
                       contacts.place[c, 2] - points[p, 2])  # fmt: skip
            away = x * x + y * y + z * z
            if away < least:
                out, least = p, away
    return out


@inner_kernel
def _local(solved, c, pyramidal, out):
    """Writes force and moment (6,) [N, N m] on a contact's second geom, in the contact's frame."""
    row, force = solved.row[c], solved.force
    for i in range(6):
        out[i] = 0.0
    if row < 0:
        return
    size = solved.size[c]
    if not pyramidal:
        for i in range(size):
            out[i] = force[row + i]
        return
    if size == 1:
        out[0] = force[row]
        return
    for i in range(2 * (size - 1)):
        out[0] += force[row + i]
    for i in range(size - 1):
        out[i + 1] = (force[row + 2 * i] - force[row + 2 * i + 1]) * solved.friction[c, i]


@inner_kernel
def add_moment(place, com, force, out):
    """Adds the moment of a force at a place about a centre of mass to out[3:6]."""
    x, y, z = place[0] - com[0], place[1] - com[1], place[2] - com[2]
    out[3] += y * force[2] - z * force[1]
    out[4] += z * force[0] - x * force[2]
    out[5] += x * force[1] - y * force[0]


@inner_kernel
def write_com_velocity(inertia, moving, out):
    """Writes the velocity (3,) [m/s] of a robot's centre of mass: momentum over mass of its bodies as they are.

    Args:
        inertia: (nbody, 10) MuJoCo's `cinert`: of bodies about that point, mass times place from it, mass.
        moving: (nbody, 6) MuJoCo's `cvel`: how they turn, and how they would move there.
        out: (3,) overwritten.
    """
    out[0], out[1], out[2] = 0.0, 0.0, 0.0
    mass = 0.0
    for b in range(1, inertia.shape[0]):
        i, v = inertia[b], moving[b]
        mass += i[9]
        out[0] += i[9] * v[3] + v[1] * i[8] - v[2] * i[7]
        out[1] += i[9] * v[4] + v[2] * i[6] - v[0] * i[8]
        out[2] += i[9] * v[5] + v[0] * i[7] - v[1] * i[6]
    for k in range(3):
        out[k] /= mass


@inner_kernel
def write_spin(inertia, moving, out):
    """Writes the angular momentum (3,) [N m s] of a robot about its centre of mass.

    Args:
        inertia: (nbody, 10) MuJoCo's `cinert`: of bodies about that point, mass times place from it, mass.
        moving: (nbody, 6) MuJoCo's `cvel`: how they turn, and how they would move there.
        out: (3,) or longer, overwritten.
    """
    out[0], out[1], out[2] = 0.0, 0.0, 0.0
    for b in range(1, inertia.shape[0]):
        i, v = inertia[b], moving[b]
        out[0] += i[0] * v[0] + i[3] * v[1] + i[4] * v[2] - i[8] * v[4] + i[7] * v[5]
        out[1] += i[3] * v[0] + i[1] * v[1] + i[5] * v[2] + i[8] * v[3] - i[6] * v[5]
        out[2] += i[4] * v[0] + i[5] * v[1] + i[2] * v[2] - i[7] * v[3] + i[6] * v[4]


@kernel
def add_forces(points, feet, contacts, solved, pyramidal, com, work, local, force, total):
    """Adds the ground's forces in the latest step.

    Args:
        points: (P, 3) [m] contact points when the tick began.
        feet: (P,) their feet.
        contacts: `Contacts` of the step.
        solved: `Solved`, likewise.
        pyramidal: Whether friction cones are pyramids.
        com: (3,) [m] centre of mass of the robot in the step.
        work: (P + 2, 3) work space.
        local: (6,) likewise.
        force: (P, 3) [N] on the contact points.
        total: (6,) [N, N m] on the whole robot, its feet or other parts: force, and moment about its centre of mass.
    """
    size = feet.size
    work[: size + 1] = 0.0
    whole, world = work[size], work[size + 1]
    for c in range(contacts.gap.size):
        side = 0.0
        if contacts.is_ground[contacts.geoms[c, 0]]:
            side += 1.0
        if contacts.is_ground[contacts.geoms[c, 1]]:
            side -= 1.0
        if side == 0.0:
            continue
        _local(solved, c, pyramidal, local)
        axes = solved.axes[c]
        for i in range(3):
            world[i] = side * (local[0] * axes[i] + local[1] * axes[3 + i] + local[2] * axes[6 + i])
        p = nearest_point(points, feet, contacts, c)
        add_moment(contacts.place[c], com, world, total)
        for i in range(3):
            # Of contacts that resist turning too.
            total[3 + i] += side * (local[3] * axes[i] + local[4] * axes[3 + i] + local[5] * axes[6 + i])
            whole[i] += world[i]
            if p >= 0:
                work[p, i] += world[i]
    for i in range(3):
        total[i] += whole[i]
        for p in range(size):
            force[p, i] += work[p, i]
