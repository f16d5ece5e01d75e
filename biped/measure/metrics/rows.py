"""What one row of a run, and one step between two rows, add to the sums that metrics are made of; compiled.

A force F over a step changes the kinetic energy by F · (v + v')/2 · dt, impacts included: powers of a step are taken at
the mean of its velocities, in the configuration that it begins with.
"""

from __future__ import annotations

import math

from biped.base.jit import inner_kernel
from biped.measure.columns import ACTIVE, FORCE, PHASE, Q_D, STOP, TIME, Q, U, V
from biped.robot.ground import height_below
from biped.robot.planar.kinematics import forward
from biped.robot.planar.topology import (
    ANKLE,
    BASE,
    ENDS,
    FOOT,
    HIP,
    KNEE,
    LEGS,
    N_CONSTRAINTS,
    N_LINKS,
    N_POINTS,
    NQ,
    NU,
    PARENT,
    PITCH,
    POINT_LEG,
    THIGH,
    TORSO,
    X,
    Z,
)


@inner_kernel
def larger(best, x):
    """The larger of two; a number that is none stays, and wins."""
    return best if x <= best or math.isnan(best) else x


@inner_kernel
def add_row(s, at, before, log, point, pushes, seat, k):
    """Adds row k, and the step that leads to it.

    Args:
        s: `biped.measure.metrics.sums.SUMS`.
        at: `PLACES`, filled with those of this row.
        before: `PLACES` of the row before.
        log: (n, WIDTH).
        point: (n, 4, 2) [m] places of the contact points; row k is written.
        pushes: (m, 5) first row, last row + 1, force along and normal to the ground [N], link.
        seat: (n, 3) of a seat: force along and normal to the ground [N], moment about the torso's origin [N m]; (0, 3)
            without one.
        k: Number of the row.

    Returns:
        Whether a link is too fast (`biped.measure.verdict`); the row is left out then, unless it is the first.
    """
    told, run, tree, line = s["told"], s["run"], s["tree"], log[k]
    q, v = line[Q : Q + NQ], line[V : V + NQ]
    forward(tree, q, v, q[X], q[Z], at)
    squared, turning, moving, rest, momentum = 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(N_LINKS):
        mass, x, z = tree["mass"][j], at["com_velocity"][j, 0], at["com_velocity"][j, 1]
        speed, rate = x * x + z * z, at["rate"][j] * at["rate"][j]
        squared, turning = larger(squared, speed), larger(turning, rate)
        moving += 0.5 * mass * speed
        rest += 0.5 * tree["inertia"][j] * rate
        rest -= mass * (told["gravity"][0] * at["com"][j, 0] + told["gravity"][1] * at["com"][j, 1])
        momentum += mass * z
    fast = _too_fast(told, squared, turning, q[X] - log[0, Q + X])
    if fast and k > 0:
        return True
    for j in range(NU):
        rest += 0.5 * tree["armature"][j] * v[BASE + j] * v[BASE + j]
        run["torque"] = larger(run["torque"], abs(line[U + j]))
    for i in range(N_POINTS):
        x, z = at["point"][i, 0], at["point"][i, 1]
        point[k, i, 0], point[k, i, 1] = x, z
        run["depth"] = larger(run["depth"], height_below(s["ground"], x) - z)
        run["normal"] = larger(run["normal"], line[FORCE + 2 * i + 1])
    run["squared"], run["moving"] = larger(run["squared"], squared), larger(run["moving"], moving)
    if k == 0:
        run["energy"][0], run["momentum"][0] = moving + rest, momentum
    else:
        _add_step(s, at, before, log[k - 1], line, pushes, seat, k - 1)
        gained = moving + rest - run["energy"][0] - run["given"]
        run["nowhere"] = gained if k == 1 else larger(run["nowhere"], gained)
    run["energy"][1], run["momentum"][1] = moving + rest, momentum
    if told["first"] <= k < told["last"]:
        _add_to_window(s, at, log, k)
        if seat.shape[0] > 0:
            s["window"]["sat"] += seat[k, 1]
    return fast


@inner_kernel
def _too_fast(told, squared, turning, way):
    """Whether squares of a link's speed and rate are beyond what energy there is, `way` [m] from the start."""
    mass, inertia = told["least_mass"], told["least_inertia"]
    root = math.sqrt(told["level"] + max(0.0, told["downhill"] * way)) + told["pushed"]
    return not (0.5 * mass * squared <= root * root and 0.5 * inertia * turning <= root * root)


@inner_kernel
def _add_step(s, at, before, was, line, pushes, seat, k):
    """Adds the step from row k to the next: work, energy put in, impulse of the ground."""
    told, run, tree = s["told"], s["run"], s["tree"]
    column, count = (Q_D, NQ) if told["generalized"] else (U, NU)
    actuators, given, others, ground = 0.0, 0.0, 0.0, 0.0
    for i in range(count):
        j = NQ - count + i
        actuators += was[column + i] * 0.5 * (was[V + j] + line[V + j])
        given += was[column + i] * (line[Q + j] - was[Q + j])
    pushing = 0.0
    for p in range(pushes.shape[0]):
        if pushes[p, 0] <= k < pushes[p, 1]:
            link, fx, fz = int(pushes[p, 4]), pushes[p, 2], pushes[p, 3]
            here, there = before["com"][link], at["com"][link]
            pushing += _power(at, before, was, line, link, here[0], here[1], fx, fz)
            given += fx * (there[0] - here[0]) + fz * (there[1] - here[1])
    for leg in range(LEGS):
        others += was[STOP + leg] * 0.5 * (was[V + KNEE[leg]] + line[V + KNEE[leg]])
    for j in range(NU):
        mean = 0.5 * (was[V + BASE + j] + line[V + BASE + j])
        others -= tree["damping"][j] * mean * mean
    for i in range(N_POINTS):
        fx, fz = was[FORCE + 2 * i], was[FORCE + 2 * i + 1]
        run["impulse"] += fz
        if fx != 0.0 or fz != 0.0:
            x, z = before["point"][i, 0], before["point"][i, 1]
            ground += _power(at, before, was, line, FOOT[POINT_LEG[i]], x, z, fx, fz)
    if seat.shape[0] > 0:
        run["impulse"] += seat[k, 1]
        for i, j in enumerate((X, Z, PITCH)):
            ground += seat[k, i] * 0.5 * (was[V + j] + line[V + j])
    run["work"] += actuators + pushing + others + ground
    run["put_in"] += abs(actuators) + abs(pushing)
    run["given"] += given
    run["given_either_way"] += abs(given)


@inner_kernel
def _power(at, before, was, line, link, x, z, fx, fz):
    """Power [W] of a force at a place (x, z) of a link in the configuration `before`, at the step's mean velocity."""
    vx, vz = 0.5 * (was[V + X] + line[V + X]), 0.5 * (was[V + Z] + line[V + Z])
    i = link
    while i >= TORSO:
        rate = 0.5 * (before["rate"][i] + at["rate"][i])
        px, pz = before["joint"][i, 0], before["joint"][i, 1]
        vx -= (z - pz) * rate
        vz += (x - px) * rate
        x, z = px, pz
        i = PARENT[i]
    return fx * vx + fz * vz


@inner_kernel
def _add_to_window(s, at, log, k):
    """Adds row k to the sums over the window."""
    w, line, first = s["window"], log[k], k == s["told"]["first"]
    x, pitch = line[Q + X], line[Q + PITCH]
    if first:
        w["x"][:], w["time"][:] = x, line[TIME]
        w["start"][0], w["start"][1] = line[V + X], pitch  # which deviations are taken from
    w["x"][1], w["time"][1] = x, line[TIME]
    w["x_range"][0] = min(x, w["x_range"][0]) if not first else x
    w["x_range"][1] = max(x, w["x_range"][1]) if not first else x
    w["x_sum"] += x
    for i in range(2):
        away = (line[V + X] if i == 0 else pitch) - w["start"][i]
        w["away"][i] += away
        w["away_squared"][i] += away * away
    w["rows"] += 1
    if not first:
        _add_changes(w, log[k - 1], line)
    _add_actuators(s, at, line)
    _add_contacts(w, at, line)


@inner_kernel
def _add_changes(w, was, line):
    """Adds what changed since the row before: leg states, constraints, torques."""
    jump, changed = 0.0, 0
    for leg in range(LEGS):
        w["switches"] += was[PHASE + leg] != line[PHASE + leg]
    for i in range(N_CONSTRAINTS):
        changed |= was[ACTIVE + i] != line[ACTIVE + i]
    for j in range(NU):
        jump = larger(jump, abs(line[U + j] - was[U + j]))
    w["constraint_switches"] += changed
    w["jumps"] += jump


@inner_kernel
def _add_actuators(s, at, line):
    """Adds torques and powers; of generalized forces those of their springs, in whose places Q_d acts."""
    told, w = s["told"], s["window"]
    over, net = 0, 0.0
    for j in range(NU):
        u, power = abs(line[U + j]), line[U + j] * line[V + BASE + j]
        w["torque"][j] += u
        w["torque_most"][j] = larger(w["torque_most"][j], u)
        w["power_most"][j] = larger(w["power_most"][j], abs(power))
        over |= u >= told["limit"][j]
        if not told["generalized"]:
            net += power
            _add_power(w, power)
    w["saturated"] += over
    if told["generalized"]:
        torso = line[Q_D + PITCH]
        for leg in range(LEGS):
            hip, knee, ankle = HIP[leg], KNEE[leg], ANKLE[leg]
            torso -= line[Q_D + hip]
            for power in (
                line[Q_D + hip] * at["rate"][THIGH[leg]], line[Q_D + knee] * line[V + knee],
                line[Q_D + ankle] * line[V + ankle],
            ):  # fmt: skip
                net += power
                _add_power(w, power)
        net += torso * at["rate"][TORSO]
        _add_power(w, torso * at["rate"][TORSO])
    w["net"] += abs(net)


@inner_kernel
def _add_power(w, power):
    w["absolute"] += abs(power)
    w["positive"] += max(power, 0.0)
    w["peak"] = larger(w["peak"], abs(power))


@inner_kernel
def _add_contacts(w, at, line):
    """Adds ground forces and their power."""
    for leg in range(LEGS):
        total = 0.0
        for i in range(ENDS * leg, ENDS * leg + ENDS):
            fx, fz = line[FORCE + 2 * i], line[FORCE + 2 * i + 1]
            vx, vz = at["point_velocity"][i, 0], at["point_velocity"][i, 1]
            w["ground_power"] += fx * vx + fz * vz
            total += fz
        w["normal"] += total
