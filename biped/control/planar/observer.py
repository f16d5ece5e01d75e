"""The disturbance observer (`biped.control.observer`) of seven links: what it sees of them at a tick."""

from biped.base.jit import kernel
from biped.control.observer import notice, notice_end, update
from biped.control.planar.constraints import believed_bias
from biped.robot.planar.topology import BASE, HEEL, KNEE, LEGS, N_POINTS, NQ, NU, SEGMENTS, THIGH, TOE

_STRAIGHT = 5e-4
"""[rad] from its stop within which a knee may press on it."""


@kernel
def _turn(row, x, z):
    """Writes the motion of the base that turns it by one about a place (x, z)."""
    row[0], row[1], row[2] = z, -x, 1.0


@kernel
def observe(c, M, q, v, first):
    """Brings the estimate to a tick; the torques that are known are those of the tick before.

    Args:
        c: Controller record with sensed links.
        M: (9, 9) mass matrix that the law believes in, upper triangle.
        q: (9,) joint coordinates [m, rad].
        v: (9,) joint velocities.
        first: Whether this is the run's first tick, which shows nothing.
    """
    o, at = c["observer"], c["at"]
    believed_bias(c)
    left, h, before, touching = o["left"], c["tick"]["h"], o["v"], o["touching"]
    for i in range(N_POINTS):
        notice(o, i, c["tick"]["height"][i])
    for leg in range(LEGS):
        toe, heel = TOE[leg], HEEL[leg]
        o["standing"][leg], o["frees"][leg] = touching[toe] or touching[heel], touching[toe] != touching[heel]
        point = at["point"][toe if touching[toe] else heel]
        _turn(o["free"][leg, 0], point[0], point[1])
        for i in range(SEGMENTS):
            joint = at["joint"][THIGH[leg] + i]
            _turn(o["arm"][SEGMENTS * leg + i], joint[0], joint[1])
        notice_end(o, KNEE[leg] - BASE, 1 if q[KNEE[leg]] > -_STRAIGHT else 0)
    if not first:
        for i in range(NQ):
            s = 0.5 * (h[i] + o["h"][i])
            for j in range(NQ):
                s += M[min(i, j), max(i, j)] * (v[j] - before[j]) / o["tick"]
            left[i] = s
        for j in range(NU):
            left[BASE + j] += 0.5 * c["tree"]["damping"][j] * (v[BASE + j] + before[BASE + j]) - o["applied"][j]
        update(o, c["actuation"]["limit"])
    for j in range(NQ):
        before[j], o["h"][j] = v[j], h[j]
