"""A disturbance observer: joint torques that the law's mechanics do not explain, from how the walker speeds up.

What the latest difference of velocities says is missing, M Δv/dt + h + losses - u, is ground forces and disturbances of
joints. The base has no motor, so its own rows are the generalized force W of the ground on it. A joint of a leg that
stands bears B W of that (rows B of `arm`), where B is the velocity of the base that would move the foot as the joint
does. A foot that is alone on the ground has all of W, and a leg in the air none: then every joint's disturbance is
known, whatever touches of that foot. If both feet are near the ground, W is split so that the disturbances change as
little as can be. A foot that touches with one point, or along one line, exerts no moment about it. A joint at the end
of its range says nothing.

The estimate goes to what is seen with a rate K, as that of the observer of the generalized momentum does (A. De Luca,
R. Mattone, ICRA 2005), and the law takes it off the torques that it asks for.
"""

import math

import numpy as np

from biped.base.jit import inner_kernel, kernel
from biped.control.blending import fraction

CLEAR = 2e-4
"""[m] above the ground beyond which a point that is sensed does not touch it."""
MOST = 0.5
"""Share of a joint's limit beyond which no disturbance is believed."""
_TURNS = 10.0
"""Weight of a moment about the place at which a foot touches, against that of a disturbance, in the split."""
_TIE = 1e-9
"""Raises the diagonal of the split by this fraction: legs stretched alike leave a direction open."""
FEET = 2


def observer_type(base: int, joints: int, points: int) -> np.dtype:
    """Of an observer: settings, the estimate, memory of the tick before, and what the split works with.

    Args:
        base: Coordinates of the base.
        joints: Coordinates of a leg.
        points: Contact points of both feet.
    """
    driven = FEET * joints
    number = driven + base
    return np.dtype(
        [
            ("follow", "f8"), ("tick", "f8"), ("clear", "f8"),  # share gone in a tick, s, m
            ("estimate", "f8", driven), ("applied", "f8", driven),  # N m
            ("v", "f8", number), ("h", "f8", number),
            ("left", "f8", number), ("arm", "f8", (driven, base)),  # N m; B
            ("silent", "u1", driven), ("ended", "u1", driven),  # at an end, now or a tick ago
            ("touching", "u1", points), ("lately", "u1", points),  # likewise
            ("free", "f8", (FEET, base, base)), ("frees", "i8", FEET),  # no moments about these
            ("standing", "u1", FEET),
            ("force", "f8", (FEET, base)), ("N", "f8", (base, base)),
        ],
        align=True,
    )  # fmt: skip


def set_observer(o: np.void, bandwidth: float, tick: float) -> None:
    """Writes the settings of an observer into its record.

    Args:
        o: The record.
        bandwidth: K [1/s]; 0: nothing is observed.
        tick: [s].
    """
    o["follow"] = fraction(1.0 / bandwidth, tick) if bandwidth > 0.0 else 0.0
    o["tick"], o["clear"] = tick, CLEAR


@inner_kernel
def remember(o, u):
    """Keeps the torques of the tick before, whatever became of them since the law asked for them."""
    for j in range(u.size):
        o["applied"][j] = u[j]


@inner_kernel
def notice(o, i, height):
    """Notes the height [m] of contact point i; writes whether it may have pushed since the tick before."""
    now = 1 if height < o["clear"] else 0
    o["touching"][i], o["lately"][i] = max(now, o["lately"][i]), now


@inner_kernel
def notice_end(o, j, at_end):
    """Notes whether driven joint j is at the end of its range; writes whether that may have pushed it."""
    o["silent"][j], o["ended"][j] = max(at_end, o["ended"][j]), at_end


@kernel
def _split(o):
    """Writes the force of each foot into `force` where both are near the ground."""
    N, W, left, arm = o["N"], o["force"], o["left"], o["arm"]
    base, other = N.shape[0], o["estimate"].size // FEET
    for a in range(base):
        W[0, a] = 0.0
        for b in range(base):
            N[a, b] = 0.0
    for j in range(o["estimate"].size):
        if o["silent"][j]:
            continue
        s, sign = left[base + j], 1.0
        if j >= other:
            sign = -1.0
            for k in range(base):
                s -= arm[j, k] * left[k]
        for a in range(base):
            W[0, a] += sign * s * arm[j, a]
            for b in range(a + 1):
                N[a, b] += arm[j, a] * arm[j, b]
    for foot in range(FEET):
        for i in range(o["frees"][foot]):
            n, s = o["free"][foot, i], 0.0
            if foot == 1:
                for k in range(base):
                    s += n[k] * left[k]
            for a in range(base):
                W[0, a] += _TURNS * n[a] * s
                for b in range(a + 1):
                    N[a, b] += _TURNS * n[a] * n[b]
    for a in range(base):  # Cholesky's, in place
        N[a, a] *= 1.0 + _TIE
        for b in range(a):
            for k in range(b):
                N[a, b] -= N[a, k] * N[b, k]
            N[a, b] /= N[b, b]
            N[a, a] -= N[a, b] * N[a, b]
            W[0, a] -= N[a, b] * W[0, b]
        N[a, a] = math.sqrt(max(N[a, a], _TIE))
        W[0, a] /= N[a, a]
    for a in range(base - 1, -1, -1):
        for k in range(a + 1, base):
            W[0, a] -= N[k, a] * W[0, k]
        W[0, a] /= N[a, a]
    for a in range(base):
        W[1, a] = left[a] - W[0, a]


@inner_kernel
def update(o, limit):
    """Brings the estimate on by a tick.

    Args:
        o: Record of `observer_type`; `left` has what M, h, losses and the torques applied do not explain.
        limit: [N m] of the torques.
    """
    base, left, W, size = o["N"].shape[0], o["left"], o["force"], o["estimate"].size
    joints = size // FEET
    for j in range(size):
        left[base + j] -= o["estimate"][j]
    if o["standing"][0] and o["standing"][1]:
        _split(o)
    else:
        for foot in range(FEET):
            for k in range(base):
                W[foot, k] = left[k] if o["standing"][foot] else 0.0
    for j in range(size):
        if o["silent"][j]:
            continue
        s = left[base + j]
        for k in range(base):
            s -= o["arm"][j, k] * W[j // joints, k]
        most = MOST * limit[j]
        o["estimate"][j] = min(max(o["estimate"][j] + o["follow"] * s, -most), most)


@inner_kernel
def compensate(o, u, limit):
    """Takes the estimate off the torques u asked for, within their limits."""
    for j in range(u.size):
        u[j] = min(max(u[j] - o["estimate"][j], -limit[j]), limit[j])
