"""The mechanics that the law in space computes by itself from sensed coordinates: by kernels, or by Pinocchio.

Kernels are refereed by Pinocchio, which has algorithms of its own, once for every model (`biped.base.kernels`).
"""

from typing import Any, NamedTuple

import mujoco
import numpy as np

from biped.base.errors import InputError
from biped.base.jit import bound, entry_kernel, kernel
from biped.base.kernels import agreed
from biped.control.space.dynamics import compute_mechanics
from biped.control.space.places import Mechanics
from biped.control.space.setup import entries_of
from biped.robot.tree import BodyTree, pinocchio_model, tree_of

STATES = 5
"""Random ones at which both have to agree."""
SAME = 1e-11
"""How well, relative to the largest number."""


class Own(NamedTuple):
    """Mechanics of the law's own.

    Attributes:
        tree: What they are computed of.
        mechanics: The latest.
    """

    tree: BodyTree
    mechanics: Mechanics


def own_of(c: np.void, model: mujoco.MjModel, q: np.ndarray, v: np.ndarray) -> Own:
    """Mechanics to be computed.

    Args:
        c: The controller record.
        model: What the law believes in, as the file says it; nothing but its numbers is read.
        q: (nq,) sensed coordinates, live.
        v: (nv,) sensed velocities, live.

    Raises:
        InputError: The model has parts that only MuJoCo computes with.
    """
    nv, bodies = model.nv, model.nbody
    out = Mechanics(
        q, v, np.zeros(model.nC), entries_of(c, model), np.zeros(nv), np.zeros((nv, 6)), np.zeros((nv, 6)),
        np.zeros((bodies, 6)), np.zeros((bodies, 3)), np.zeros((bodies, 9)), np.zeros((bodies, 3)),
    )  # fmt: skip
    out.turned[0, [0, 4, 8]] = 1.0
    return Own(tree_of(model), out)


def check_kernels(c: np.void, model: mujoco.MjModel, tree: BodyTree) -> None:
    """Makes sure that the kernels find what Pinocchio finds, at a few random states.

    Args:
        c: The controller record.
        model: As of `own_of`.
        tree: Of it, as it was read.

    Raises:
        InputError: They do not.
    """
    if not agreed(b"".join(part.tobytes() for part in tree), lambda: _refereed(c, model)):
        raise InputError("control.mechanics: expected 'pinocchio' or 'engine': the kernels find other mechanics of "
                         "this model than Pinocchio", "control.mechanics")  # fmt: skip


def _refereed(c: np.void, model: mujoco.MjModel) -> bool:
    random, read = np.random.default_rng(0), [c["belief"]["root"], *c["belief"]["link"], *c["belief"]["foot"]]
    q, v = model.qpos0.copy(), np.zeros(model.nv)
    mine, theirs = own_of(c, model, q, v), Pinocchio(c, model, q, v)
    for _ in range(STATES):
        mujoco.mj_integratePos(model, q, random.normal(size=model.nv), 1.0)
        v[:] = random.normal(size=model.nv)
        compute(*mine)
        theirs.renew()
        for name in ("M", "h", "axes", "twist", "com", "turned", "origin"):
            one, other = (getattr(own.mechanics, name) for own in (mine, theirs))
            if len(one) == model.nbody:
                one, other = one[read], other[read]
            if not np.abs(one - other).max() <= SAME * np.abs(other).max():
                return False
    return True


@entry_kernel
def compute(tree, m):
    """`compute_mechanics` for calls from Python."""
    compute_mechanics(tree, m)


class Pinocchio:
    """Mechanics by Pinocchio, in MuJoCo's coordinates; only of the bodies that the law reads.

    Pinocchio's base has its linear velocity along its own axes, MuJoCo's along the world's.

    Args:
        c: The controller record.
        model: As of `own_of`.
        q: Likewise.
        v: Likewise.

    Attributes:
        mechanics: The latest.
    """

    def __init__(self, c: np.void, model: mujoco.MjModel, q: np.ndarray, v: np.ndarray):
        import pinocchio

        self._pin: Any = pinocchio
        self._tree, self.mechanics = own_of(c, model, q, v)
        self._model = pinocchio_model(self._tree)
        self._data: Any = self._model.createData()
        self._q, self._v = np.zeros(self._model.nq), np.zeros(model.nv)
        belief = c["belief"]
        bodies = sorted({int(body) for body in (belief["root"], *belief["link"], *belief["foot"])})
        self._frames = [(body, self._model.getFrameId(str(body))) for body in bodies]
        self._chains = np.array([_chain(self._tree, body) for body in bodies])
        self._bodies = np.array(bodies)
        data = self._data
        self._found = data.M, data.nle, data.J, data.dJ
        self._give = bound(_to_pinocchio, self._tree, q, v, self._q, self._v)
        self._take = bound(
            _from_pinocchio, self._tree, *self._found, data.com[0], self._bodies, self._chains, self.mechanics
        )

    def renew(self) -> None:
        """Brings the mechanics to the sensed state."""
        pin, model, data, m, q, v = self._pin, self._model, self._data, self.mechanics, self._q, self._v
        self._give(self._tree, m.q, m.v, q, v)
        pin.crba(model, data, q, pin.Convention.WORLD)
        pin.computeJointJacobiansTimeVariation(model, data, q, v)
        pin.nonLinearEffects(model, data, q, v)
        pin.centerOfMass(model, data, q)
        pin.updateFramePlacements(model, data)
        for body, frame in self._frames:
            place = data.oMf[frame]
            m.turned[body], m.origin[body] = place.rotation.ravel(), place.translation
        self._take(self._tree, *self._found, data.com[0], self._bodies, self._chains, m)


def _chain(tree: BodyTree, body: int) -> np.ndarray:
    """(nv,) whether each velocity moves a body."""
    out, bodies = np.zeros(len(tree.dofs), dtype=bool), tree.bodies
    while body > 0:
        first = bodies[body]["first"]
        out[first : first + bodies[body]["count"]] = True
        body = bodies[body]["parent"]
    return out


@kernel
def _to_pinocchio(tree, q, v, to_q, to_v):
    """Writes coordinates as Pinocchio counts them: joints from their zeros, scalar part of the orientation last."""
    bodies, dofs = tree.bodies, tree.dofs
    at = 0
    for b in range(1, bodies.size):
        first = bodies[b]["first"]
        if bodies[b]["free"] >= 0:
            base = q[bodies[b]["free"] :]
            scale = 1.0 / np.sqrt(base[3] ** 2 + base[4] ** 2 + base[5] ** 2 + base[6] ** 2)
            w, x, y, z = scale * base[3], scale * base[4], scale * base[5], scale * base[6]
            for i in range(3):
                to_q[at + i], to_v[first + 3 + i] = base[i], v[first + 3 + i]
            to_q[at + 3], to_q[at + 4], to_q[at + 5], to_q[at + 6] = x, y, z, w
            a, c, e = v[first], v[first + 1], v[first + 2]
            to_v[first] = (1.0 - 2.0 * (y * y + z * z)) * a + 2.0 * (x * y + w * z) * c + 2.0 * (x * z - w * y) * e
            to_v[first + 1] = 2.0 * (x * y - w * z) * a + (1.0 - 2.0 * (x * x + z * z)) * c + 2.0 * (y * z + w * x) * e
            to_v[first + 2] = 2.0 * (x * z + w * y) * a + 2.0 * (y * z - w * x) * c + (1.0 - 2.0 * (x * x + y * y)) * e
            at += 7
            continue
        for j in range(first, first + bodies[b]["count"]):
            to_q[at], to_v[j] = q[dofs[j]["place"]] - dofs[j]["zero"], v[j]
            at += 1


@kernel
def _from_pinocchio(tree, M, nle, J, rate, com, read, chains, m):
    """Fills the mechanics from Pinocchio's M, bias forces, world-frame Jacobian at the origin, its rate, and places."""
    bodies, dofs = tree.bodies, tree.dofs
    cx, cy, cz = com[0], com[1], com[2]
    for j in range(dofs.size):
        x, y, z = J[3, j], J[4, j], J[5, j]
        m.axes[j, 0], m.axes[j, 1], m.axes[j, 2] = x, y, z
        m.axes[j, 3], m.axes[j, 4], m.axes[j, 5] = (
            J[0, j] + y * cz - z * cy, J[1, j] + z * cx - x * cz, J[2, j] + x * cy - y * cx,
        )  # fmt: skip
        x, y, z = rate[3, j], rate[4, j], rate[5, j]
        m.axes_rate[j, 0], m.axes_rate[j, 1], m.axes_rate[j, 2] = x, y, z
        m.axes_rate[j, 3], m.axes_rate[j, 4], m.axes_rate[j, 5] = (
            rate[0, j] + y * cz - z * cy, rate[1, j] + z * cx - x * cz, rate[2, j] + x * cy - y * cx,
        )  # fmt: skip
        m.h[j] = nle[j]
        k = dofs[j]["row"]
        while True:
            column = tree.columns[k]
            m.M[k] = M[column, j]
            if column == j:
                break
            k += 1
    for b in range(1, bodies.size):
        m.com[b, 0], m.com[b, 1], m.com[b, 2] = cx, cy, cz
        if bodies[b]["free"] >= 0:
            _along_the_world(tree, M, m, b)
    for i in range(read.size):
        for k in range(6):
            s = 0.0
            for j in range(dofs.size):
                if chains[i, j]:
                    s += m.axes[j, k] * m.v[j]
            m.twist[read[i], k] = s


@kernel
def _along_the_world(tree, M, m, b):
    """Brings what belongs to a base's linear velocity from its own axes, which turn, to the world's, which do not."""
    first, R, v = tree.bodies[b]["first"], m.turned[b], m.v
    # The acceleration of Pinocchio's coordinates that is none of MuJoCo's: (Rᵀv)' = -ω × Rᵀv.
    wx, wy, wz = v[first + 3], v[first + 4], v[first + 5]
    ux = R[0] * v[first] + R[3] * v[first + 1] + R[6] * v[first + 2]
    uy = R[1] * v[first] + R[4] * v[first + 1] + R[7] * v[first + 2]
    uz = R[2] * v[first] + R[5] * v[first + 1] + R[8] * v[first + 2]
    ax, ay, az = wz * uy - wy * uz, wx * uz - wz * ux, wy * ux - wx * uy
    for j in range(m.h.size):
        for i in range(3):
            a = ax if i == 0 else ay if i == 1 else az
            m.h[j] += (M[first + i, j] if first + i <= j else M[j, first + i]) * a
    hx, hy, hz = m.h[first], m.h[first + 1], m.h[first + 2]
    for i in range(3):
        m.h[first + i] = R[3 * i] * hx + R[3 * i + 1] * hy + R[3 * i + 2] * hz
        for k in range(6):
            m.axes[first + i, k] = m.axes_rate[first + i, k] = 0.0
        m.axes[first + i, 3 + i] = 1.0
    for j in range(first + 3, m.h.size):
        k = tree.dofs[j]["row"]
        while tree.columns[k] < first:
            k += 1
        if tree.columns[k] != first:
            continue
        for i in range(3):
            s = 0.0
            for a in range(3):
                s += R[3 * i + a] * M[first + a, j]
            m.M[k + i] = s
