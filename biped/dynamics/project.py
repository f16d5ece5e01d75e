"""Back onto the constraints, without adding more noise than is taken away."""

import numpy as np

from biped.base.jit import kernel
from biped.dynamics.codes import INDEFINITE, NOT_PROJECTED, OK
from biped.dynamics.compiled import shared
from biped.dynamics.evaluate import apply, evaluate, find_lag, product, renew, resolve
from biped.dynamics.room import AIM, LAG, MOVE, PHI, PLACE, SPEED, largest

PROJECTIONS = 30  # Newton iterations of a projection
PROJECTED_TO = 1e-14  # and the relative motion of q that ends them
ROUNDING = 4e-16  # relative error of Φ and Φ̇ as they are computed
PLAIN = 0.1  # pivot ratio below which what a place is off by makes itself felt by its square


@kernel
def is_noise(moved, size, ratio, power):
    """Whether a correction is no larger than its own rounding error.

    Φ is computed to within ε, and its correction to within ε/ratio; Φ̇ is off by what A is off by, which is
    that, and its correction by ε/ratio².
    """
    return moved * ratio**power <= ROUNDING * (1.0 + size)


@kernel
def find_move(away, room):
    """room.c[MOVE] = what takes the place of the stage, subtracted, onto Φ = 0.

    Of all such motions the least one, or, of a place that has been moved by `away` (n,), the one that leaves it
    nearest to where it was before: what was moved along the constraints for nothing is taken back.
    """
    move = room.c[MOVE]
    if away.shape[0] == 0:
        apply(room.r[PHI], room, move)
        return
    product(away, room, room.r[AIM])
    for i in range(room.r.shape[1]):
        room.r[AIM, i] = room.r[PHI, i] - room.r[AIM, i]
    apply(room.r[AIM], room, move)
    for i in range(move.shape[0]):
        move[i] += away[i]


@shared
def project(gentle, choosing, away, within, f, t, p, room):
    """Newton iterations, from a state just evaluated and factored, onto Φ = 0 and Φ̇ = 0.

    `away` (n,) is what the place has been moved by already (`find_move`), and is kept so; empty: nothing that counts.
    `within` is the relative motion of q that ends the iterations where nothing singular is near; 0: to rounding.

    Beside a singular position the start of a step, which the step before left as it is, has the better velocities:
    `gentle` leaves them where their correction is rounding. A stage or a node has not, and what it does not lose
    there comes back enlarged, because the acceleration answers with −2Δv/t.

    Returns:
        A code and the largest motion of q in one iteration.
    """
    before, size = np.inf, 0.0
    for iteration in range(PROJECTIONS + 1):
        find_move(away, room)
        moved, ratio = largest(room.c[MOVE]), room.factors.ratio[0]
        size = max(size, moved)
        # Close to a singularity rounding alone moves q by more than the tolerance: stop there, too.
        if (
            moved <= max(PROJECTED_TO, within * min(1.0, (ratio / PLAIN) ** 4)) * (1.0 + largest(room.c[PLACE]))
            or is_noise(moved, largest(room.c[PLACE]), ratio, 1)
            or 0.5 * before <= moved < 1e-6
        ):
            apply(room.r[LAG], room, room.c[MOVE])
            if not (gentle and is_noise(largest(room.c[MOVE]), largest(room.c[SPEED]), ratio, 2)):
                for i in range(room.c.shape[1]):
                    room.c[SPEED, i] += room.c[MOVE, i]
                find_lag(room)
                renew(f, t, p, room)
            return OK, size
        if iteration == PROJECTIONS or not np.isfinite(moved):
            return NOT_PROJECTED, size
        for i in range(room.c.shape[1]):
            room.c[PLACE, i] -= room.c[MOVE, i]
        for i in range(away.shape[0]):
            away[i] -= room.c[MOVE, i]
        before = moved
        evaluate(f, t, p, room)
        if not resolve(choosing, room):
            return INDEFINITE, size
    return NOT_PROJECTED, size
