"""The mechanics of a biped in space by kernels of its own, from sensed coordinates and nothing else.

Composite inertias and Newton-Euler, each in one pass over the tree, with everything about the robot's centre of mass
along the world's axes, as `biped.control.space.places.Mechanics` has it. A spatial vector is angular, then linear; an
inertia is six moments (xx, yy, zz, xy, xz, yz), the first moment, the mass.
"""

import math

from biped.base.jit import inner_kernel, kernel


@kernel
def _turned(R, own, out):
    """Writes a direction (3,) of a body's frame along the axes of R (9,)."""
    x, y, z = own[0], own[1], own[2]
    for i in range(3):
        out[i] = R[3 * i] * x + R[3 * i + 1] * y + R[3 * i + 2] * z


@kernel
def _turn_about(R, axis, angle):
    """Turns a body's axes R (9,) about a unit axis in its own frame."""
    s, c = math.sin(angle), math.cos(angle)
    x, y, z, d = axis[0], axis[1], axis[2], 1.0 - c
    for i in range(3):
        a, b, e = R[3 * i], R[3 * i + 1], R[3 * i + 2]
        R[3 * i] = a * (c + x * x * d) + b * (x * y * d + z * s) + e * (x * z * d - y * s)
        R[3 * i + 1] = a * (x * y * d - z * s) + b * (c + y * y * d) + e * (y * z * d + x * s)
        R[3 * i + 2] = a * (x * z * d + y * s) + b * (y * z * d - x * s) + e * (c + z * z * d)


@kernel
def _turn_of(q, R):
    """Writes the axes R (9,) of an orientation q (4,), of any length."""
    scale = 1.0 / math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    w, x, y, z = scale * q[0], scale * q[1], scale * q[2], scale * q[3]
    R[0], R[1], R[2] = 1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)
    R[3], R[4], R[5] = 2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)
    R[6], R[7], R[8] = 2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)


@kernel
def _cross_motion(w, a, out):
    """Writes the rate of a motion a (6,) that is fixed to a body whose velocity is w (6,)."""
    out[0] = w[1] * a[2] - w[2] * a[1]
    out[1] = w[2] * a[0] - w[0] * a[2]
    out[2] = w[0] * a[1] - w[1] * a[0]
    out[3] = w[1] * a[5] - w[2] * a[4] + w[4] * a[2] - w[5] * a[1]
    out[4] = w[2] * a[3] - w[0] * a[5] + w[5] * a[0] - w[3] * a[2]
    out[5] = w[0] * a[4] - w[1] * a[3] + w[3] * a[1] - w[4] * a[0]


@kernel
def _momentum(inertia, w):
    """Moment and force, or their impulses, of an inertia (10,) that moves with w (6,)."""
    xx, yy, zz, xy, xz, yz = inertia[0], inertia[1], inertia[2], inertia[3], inertia[4], inertia[5]
    x, y, z, mass = inertia[6], inertia[7], inertia[8], inertia[9]
    return (
        xx * w[0] + xy * w[1] + xz * w[2] + y * w[5] - z * w[4],
        xy * w[0] + yy * w[1] + yz * w[2] + z * w[3] - x * w[5],
        xz * w[0] + yz * w[1] + zz * w[2] + x * w[4] - y * w[3],
        mass * w[3] + w[1] * z - w[2] * y,
        mass * w[4] + w[2] * x - w[0] * z,
        mass * w[5] + w[0] * y - w[1] * x,
    )


@inner_kernel
def _places(tree, m):
    """Fills where bodies and their centres of mass are; of hinges and slides axes, and where hinges are in their place.

    Returns:
        The robot's centre of mass.
    """
    bodies, dofs = tree.bodies, tree.dofs
    total, cx, cy, cz = 0.0, 0.0, 0.0, 0.0
    for b in range(1, bodies.size):
        body, R, place = bodies[b], m.turned[b], m.origin[b]
        if body["free"] >= 0:
            q = m.q[body["free"] :]
            place[0], place[1], place[2] = q[0], q[1], q[2]
            _turn_of(q[3:], R)
        else:
            above, start = m.turned[body["parent"]], m.origin[body["parent"]]
            _turned(above, body["place"], place)
            for i in range(3):
                place[i] += start[i]
                for j in range(3):
                    R[3 * i + j] = (
                        above[3 * i] * body["turn"][j]
                        + above[3 * i + 1] * body["turn"][3 + j]
                        + above[3 * i + 2] * body["turn"][6 + j]
                    )
            for j in range(body["first"], body["first"] + body["count"]):
                dof, axis, anchor = dofs[j], m.axes[j, :3], m.axes[j, 3:]
                away = m.q[dof["place"]] - dof["zero"]
                _turned(R, dof["axis"], axis)
                if dof["slide"]:
                    for i in range(3):
                        place[i] += away * axis[i]
                    continue
                _turned(R, dof["anchor"], anchor)
                for i in range(3):
                    anchor[i] += place[i]
                _turn_about(R, dof["axis"], away)
                _turned(R, dof["anchor"], place)
                for i in range(3):
                    place[i] = anchor[i] - place[i]
        centre, mass = body["centre"], body["mass"]
        _turned(R, body["com"], centre)
        for i in range(3):
            centre[i] += place[i]
        total += mass
        cx += mass * centre[0]
        cy += mass * centre[1]
        cz += mass * centre[2]
    return cx / total, cy / total, cz / total


@inner_kernel
def _about(tree, m, b, cx, cy, cz):
    """Fills a body's inertia about the robot's centre of mass, and the motions of its coordinates there."""
    body, R, place = tree.bodies[b], m.turned[b], m.origin[b]
    out, mass, centre, own = body["own"], body["mass"], body["centre"], body["inertia"]
    xx, yy, zz, xy, xz, yz = own[0], own[1], own[2], own[3], own[4], own[5]
    x, y, z = centre[0] - cx, centre[1] - cy, centre[2] - cz
    # A row of R I, then its products with rows of R.
    a, d, e = R[0] * xx + R[1] * xy + R[2] * xz, R[0] * xy + R[1] * yy + R[2] * yz, R[0] * xz + R[1] * yz + R[2] * zz
    f, g, h = R[3] * xx + R[4] * xy + R[5] * xz, R[3] * xy + R[4] * yy + R[5] * yz, R[3] * xz + R[4] * yz + R[5] * zz
    k, l, n = R[6] * xx + R[7] * xy + R[8] * xz, R[6] * xy + R[7] * yy + R[8] * yz, R[6] * xz + R[7] * yz + R[8] * zz
    out[0] = a * R[0] + d * R[1] + e * R[2] + mass * (y * y + z * z)
    out[1] = f * R[3] + g * R[4] + h * R[5] + mass * (x * x + z * z)
    out[2] = k * R[6] + l * R[7] + n * R[8] + mass * (x * x + y * y)
    out[3] = a * R[3] + d * R[4] + e * R[5] - mass * x * y
    out[4] = a * R[6] + d * R[7] + e * R[8] - mass * x * z
    out[5] = f * R[6] + g * R[7] + h * R[8] - mass * y * z
    out[6], out[7], out[8], out[9] = mass * x, mass * y, mass * z, mass
    for i in range(10):
        body["carried"][i] = out[i]
    first = body["first"]
    if body["free"] >= 0:
        for i in range(3):
            along, about = m.axes[first + i], m.axes[first + 3 + i]
            for j in range(6):
                along[j] = 0.0
            along[3 + i] = 1.0
            about[0], about[1], about[2] = R[i], R[3 + i], R[6 + i]
            _through(about, cx - place[0], cy - place[1], cz - place[2])
        return
    for j in range(first, first + body["count"]):
        axis = m.axes[j]
        if tree.dofs[j]["slide"]:
            for i in range(3):
                axis[3 + i] = axis[i]
                axis[i] = 0.0
        else:
            _through(axis, cx - axis[3], cy - axis[4], cz - axis[5])


@kernel
def _through(axis, x, y, z):
    """Writes the linear part of a rotation (6,) at a place (x, y, z) away from its axis."""
    axis[3], axis[4], axis[5] = axis[1] * z - axis[2] * y, axis[2] * x - axis[0] * z, axis[0] * y - axis[1] * x


@inner_kernel
def _moving(tree, m, b):
    """Fills a body's velocity, its acceleration without any of the coordinates', and the force that this takes."""
    body = tree.bodies[b]
    above, twist, rise, force = tree.bodies[body["parent"]]["rise"], m.twist[b], body["rise"], body["force"]
    for i in range(6):
        twist[i], rise[i] = m.twist[body["parent"], i], above[i]
    first = body["first"]
    after = first + body["count"]
    if body["free"] >= 0:
        for i in range(3):
            twist[3 + i] += m.v[first + i]
            for j in range(6):
                m.axes_rate[first + i, j] = 0.0
        first += 3
        for j in range(first, after):
            _cross_motion(twist, m.axes[j], m.axes_rate[j])
    for j in range(first, after):
        axis, rate, v = m.axes[j], m.axes_rate[j], m.v[j]
        if body["free"] < 0:
            _cross_motion(twist, axis, rate)
        for i in range(6):
            twist[i] += axis[i] * v
            rise[i] += rate[i] * v
    own = body["own"]
    a, e, d, x, y, z = _momentum(own, twist)
    force[0], force[1], force[2], force[3], force[4], force[5] = _momentum(own, rise)
    force[0] += twist[1] * d - twist[2] * e + twist[4] * z - twist[5] * y
    force[1] += twist[2] * a - twist[0] * d + twist[5] * x - twist[3] * z
    force[2] += twist[0] * e - twist[1] * a + twist[3] * y - twist[4] * x
    force[3] += twist[1] * z - twist[2] * y
    force[4] += twist[2] * x - twist[0] * z
    force[5] += twist[0] * y - twist[1] * x


@inner_kernel
def _rows(tree, m, b):
    """Fills a body's rows of M and its bias forces, and hands what it carries on to its parent."""
    body = tree.bodies[b]
    carried, force, first = body["carried"], body["force"], body["first"]
    for j in range(first, first + body["count"]):
        axis, dof = m.axes[j], tree.dofs[j]
        f0, f1, f2, f3, f4, f5 = _momentum(carried, axis)
        h = 0.0
        for i in range(6):
            h += axis[i] * force[i]
        m.h[j] = h
        k = dof["row"]
        while True:
            column = tree.columns[k]
            other = m.axes[column]
            m.M[k] = other[0] * f0 + other[1] * f1 + other[2] * f2 + other[3] * f3 + other[4] * f4 + other[5] * f5
            if column == j:
                m.M[k] += dof["armature"]
                break
            k += 1
    if body["parent"] > 0:
        above = tree.bodies[body["parent"]]
        for i in range(10):
            above["carried"][i] += carried[i]
        for i in range(6):
            above["force"][i] += force[i]


@inner_kernel
def compute_mechanics(tree, m):
    """Fills all of `biped.control.space.places.Mechanics` but q and v from these.

    Args:
        tree: `biped.robot.tree.BodyTree`.
        m: The mechanics; centres of mass are all the whole robot's.
    """
    cx, cy, cz = _places(tree, m)
    world = tree.bodies[0]
    for i in range(3):
        world["rise"][3 + i] = -tree.gravity[i]
    for b in range(1, tree.bodies.size):
        m.com[b, 0], m.com[b, 1], m.com[b, 2] = cx, cy, cz
        _about(tree, m, b, cx, cy, cz)
        _moving(tree, m, b)
    for b in range(tree.bodies.size - 1, 0, -1):
        _rows(tree, m, b)
