"""The motion under the active constraints: accelerations by (3.6)-(3.7), free of drift as in chapter II, and impacts.

The first constraints are the points of the feet: the height is the gap, and while one is active it also keeps its place
along the ground, unless it slides. Then come the stops of the knees: their gap is the angle to the stop.

Ten seconds of walking take 40 000 evaluations of the planar tree; at the price of Pinocchio's calls from Python they
would take longer than everything else together. Places count from the torso's centre of mass, so that they lose no
digits far along the road.
"""

from biped.base.jit import kernel
from biped.engines.rigid.gauss import (
    add_impulse,
    bias_on,
    change,
    factor_all,
    keeps_place,
    multipliers,
    other_end,
    row_on,
    shortest,
    stand_on,
    stop_sliding,
    unilateral,
)
from biped.engines.rigid.respond import residual, respond, respond_again
from biped.numerics.factor import cholesky, solve_transposed, solve_upper, weigh_rows
from biped.robot.ground import height_below
from biped.robot.planar.kinematics import add_force, bias_forces, forward, mass_matrix
from biped.robot.planar.topology import (
    BASE,
    CHAINS,
    KNEE,
    LINK_DOF,
    N_CONSTRAINTS,
    N_LINKS,
    N_POINTS,
    N_ROWS,
    N_STOPS,
    NQ,
    NU,
    POINT_LEG,
    STOP_ROW,
    X,
    Z,
)


@kernel
def place(w, q, v):
    """Fills angles, rates, places, velocities and velocity-product accelerations J̇v."""
    forward(w["tree"], q, v, 0.0, 0.0, w["at"])


@kernel
def mass_and_bias(w):
    """Fills M (9, 9), upper triangle, and h (9,), gravity included, for the configuration that `place` left."""
    bias_forces(w["tree"], w["at"], w["gravity"], w["system"]["h"])
    mass_matrix(w["tree"], w["at"], w["system"]["M"])


@kernel
def applied_forces(w, v):
    """Fills the generalized forces (9,) of actuators, dampers and pushes; a push acts at its link's centre of mass."""
    force, acting = w["system"]["force"], w["acting"]
    for j in range(NQ):
        force[j] = acting["Q"][j]
    for i in range(NU):
        force[BASE + i] -= w["tree"]["damping"][i] * v[BASE + i]
    if acting["pushed"] == 0:
        return
    for k in range(N_LINKS):
        add_force(w["at"], k, acting["push"][k, 0], acting["push"][k, 1], force)


PARTING = 1e-9
"""Relative velocity away from a constraint below which it is still touching; rounding is 1e-12."""


@kernel
def active_rows(w):
    """Fills A (m, 9), b_v = -J̇v (m,), the rows' numbers and whether they are signed; returns m.

    Normals and knees are signed, unless they are held.
    """
    system, contact = w["system"], w["contact"]
    A, b_v, row, active, signed = (
        system["A"],
        system["b_v"],
        system["row"],
        contact["active"],
        system["signed"],
    )
    m = 0
    for i in range(N_POINTS):
        if active[i]:
            for direction in range(2):
                if direction == 1 and not keeps_place(contact, i):
                    continue
                row_on(w, i, direction, A[m])
                b_v[m] = -bias_on(w, i, direction)
                row[m] = 2 * i + direction
                signed[m] = 1 if direction == 0 and not contact["held"][i] else 0
                m += 1
    for leg in range(N_STOPS):
        if active[N_POINTS + leg]:
            for j in range(NQ):
                A[m, j] = 0.0
            A[m, KNEE[leg]] = -1.0
            b_v[m] = 0.0
            row[m] = STOP_ROW + leg
            signed[m] = 1 - contact["held"][N_POINTS + leg]
            m += 1
    return m


@kernel
def gaps(w, q, v):
    """Fills the six gaps [m, rad] and their rates for the configuration that `place` left."""
    system, at = w["system"], w["at"]
    gap, rate, point = system["gap"], system["gap_rate"], at["point"]
    for i in range(N_POINTS):
        gap[i] = q[Z] + point[i, 1]
        rate[i] = v[Z]
        for k in CHAINS[POINT_LEG[i]]:
            rate[i] += (point[i, 0] - at["joint"][k, 0]) * v[k + LINK_DOF]
        if w["ground"]["count"] > 0:
            stand_on(w, i, q, v)
    for leg in range(N_STOPS):
        gap[N_POINTS + leg] = -q[KNEE[leg]]
        rate[N_POINTS + leg] = -v[KNEE[leg]]


@kernel
def evaluate(w, q, v):
    """The constrained motion at (q, v) under the forces of the tick.

    Leaves q̇ = v + W(b_q - A v) with b_q = 0, v̇ = a + W(b_v - A a), W = R⁻¹C⁺, the multipliers by row, and the shift
    -WΦ that takes the configuration back onto its constraints.
    """
    place(w, q, v)
    mass_and_bias(w)
    gaps(w, q, v)
    _forces(w, v)
    if not respond(w, q, v):
        _respond_dependent(w, q, v)


@kernel
def evaluate_again(w, q, v):
    """As `evaluate`, where only the forces of the tick are others than at the latest evaluation."""
    if w["rows"]["independent"]:
        _forces(w, v)
        respond_again(w)
    else:
        evaluate(w, q, v)


@kernel
def _forces(w, v):
    """Fills f = force - h, and the power of the forces."""
    applied_forces(w, v)
    system, f = w["system"], w["work"]["f"]
    power = 0.0
    for j in range(NQ):
        power += system["force"][j] * v[j]
        f[j] = system["force"][j] - system["h"][j]
    w["motion"]["power"] = power


@kernel
def prepare(w):
    """Fills R and C for the active rows of the configuration that `place` left; returns how many there are."""
    system = w["system"]
    cholesky(system["M"], system["R"])
    m = active_rows(w)
    weigh_rows(system["A"], system["R"], m, system["C"])
    return m


@kernel
def _respond_dependent(w, q, v):
    """The constrained motion for rows of any rank."""
    m = prepare(w)
    system, work, motion = w["system"], w["work"], w["motion"]
    R, f, d, lam = system["R"], work["f"], work["d"], motion["lam"]
    solve_transposed(R, f)
    for i in range(N_ROWS):
        lam[i] = 0.0
    v_dot, q_dot, shift, y = motion["v_dot"], motion["q_dot"], motion["shift"], work["y"]
    for j in range(NQ):
        v_dot[j], q_dot[j], shift[j] = f[j], v[j], 0.0
    rank = factor_all(w, m)
    for i in range(m):
        s = system["b_v"][i]
        for j in range(NQ):
            s -= system["C"][i, j] * f[j]
        d[i] = s
    shortest(w, m, rank)
    multipliers(w, m, rank)
    for i in range(m):
        lam[system["row"][i]] = work["multiplier"][i]
    for j in range(NQ):
        v_dot[j] += y[j]
    for i in range(m):
        s = 0.0
        for j in range(NQ):
            s -= system["A"][i, j] * v[j]
        d[i] = s
    _corrected(w, m, rank, q_dot)
    for i in range(m):
        d[i] = -residual(w, q, system["row"][i])
    _corrected(w, m, rank, shift)
    solve_upper(R, v_dot)


@kernel
def _corrected(w, m, rank, out):
    """Adds W d to out."""
    work = w["work"]
    shortest(w, m, rank)
    solve_upper(w["system"]["R"], work["y"])
    for j in range(NQ):
        out[j] += work["y"][j]


@kernel
def land(w, i, q):
    """Makes constraint i active; a point stays where it is now, and so does the other end of its foot if it slides."""
    contact = w["contact"]
    contact["active"][i] = 1
    if i >= N_POINTS:
        return
    contact["slides"][i], contact["anchor"][i] = 0, q[X] + w["at"]["point"][i, 0]
    contact["landed"][i] = height_below(w["ground"], contact["anchor"][i])
    other = other_end(i)
    if contact["active"][other] and contact["slides"][other]:
        stop_sliding(w, other, q)


@kernel
def impact(w, q, v):
    """Plastic impact (3.5) of all active constraints; v becomes v⁺, constraints that part become inactive.

    Held constraints are bilateral. Adds the impulses to the tick's and the loss to the ledger.
    """
    system, work, ledger, contact = w["system"], w["work"], w["ledger"], w["contact"]
    place(w, q, v)
    mass_and_bias(w)
    m = prepare(w)
    R, f, y, lam = system["R"], work["f"], work["y"], work["multiplier"]
    before = 0.0
    for i in range(NQ):
        s = 0.0
        for j in range(i, NQ):
            s += R[i, j] * v[j]
        f[i] = s
        y[i] = -s
        before += s * s
    unilateral(w, m)
    change(w, m, work["x"])
    after = 0.0
    for i in range(NQ):
        s = f[i]
        for k in range(m):
            s += system["C"][k, i] * lam[k]
        after += s * s
    for j in range(NQ):
        v[j] += work["x"][j]
    for i in range(m):
        add_impulse(w, system["row"][i], lam[i])
    loss = 0.5 * (before - after)
    ledger["loss"] += loss
    ledger["least_loss"] = min(ledger["least_loss"], loss)
    ledger["impacts"] += 1
    scale = 0.0
    for j in range(NQ):
        scale = max(scale, abs(v[j]))
    gaps(w, q, v)
    for i in range(N_CONSTRAINTS):
        if contact["active"][i] and not contact["held"][i] and system["gap_rate"][i] > PARTING * scale:
            contact["active"][i] = 0
