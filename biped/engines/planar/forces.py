"""Forces of the ground and of the knees' stops, read from MuJoCo's constraint solver into the log."""

from biped.base.jit import inner_kernel
from biped.engines.planar.planes import above, turned
from biped.measure.columns import FORCE, STOP, Q
from biped.robot.planar.topology import KNEE


@inner_kernel
def log_forces(log, k, efc_force, place, points, radius, contacts, stops, bent, pyramid, planes):
    """Writes the forces of ground and knee stops in the physics step that began at row k.

    MuJoCo lists joint limits first, then the contacts that exist in pair order. An elliptic cone has three rows each:
    normal, lateral and backward; a pyramid four edges, normal ± friction · lateral, then ± backward. A limit or contact
    exists where the joint or point is beyond it (no margin).

    Args:
        log: The log.
        k: Row; its configuration is the one the step began with.
        efc_force: (nefc,) MuJoCo's constraint forces [N, N m].
        place: (ngeom, 3) [m] geom positions in that configuration.
        points: (4,) numbers of the contact points' geoms.
        radius: [m] of those geoms.
        contacts: (4,) points in the order in which MuJoCo lists contacts.
        stops: (2,) stops in the order in which MuJoCo lists joint limits.
        bent: (2,) [rad] the other ends of their ranges.
        pyramid: Coefficient of friction of a pyramidal cone; 0 for an elliptic one.
        planes: `biped.engines.planar.planes.Planes`, of the same step.
    """
    rows = 4 if pyramid > 0.0 else 3
    touching = 0
    for i in range(points.size):
        if above(planes, place, points, i) < radius:
            touching += 1
    at = efc_force.size - rows * touching
    limit = 0
    for leg in stops:
        log[k, STOP + leg] = 0.0
        angle = log[k, Q + KNEE[leg]]
        if limit < at and not bent[leg] <= angle <= 0.0:
            log[k, STOP + leg] = -efc_force[limit] if angle > 0.0 else efc_force[limit]
            limit += 1
    for i in contacts:
        log[k, FORCE + 2 * i] = 0.0
        log[k, FORCE + 2 * i + 1] = 0.0
        if at >= 0 and above(planes, place, points, i) < radius:
            if pyramid > 0.0:
                log[k, FORCE + 2 * i] = -pyramid * (efc_force[at + 2] - efc_force[at + 3])
                log[k, FORCE + 2 * i + 1] = efc_force[at] + efc_force[at + 1] + efc_force[at + 2] + efc_force[at + 3]
            else:
                log[k, FORCE + 2 * i] = -efc_force[at + 2]
                log[k, FORCE + 2 * i + 1] = efc_force[at]
            at += rows
            if planes.ground[0]["count"] > 0:
                turned(planes, i, log[k])
