"""A law to start from: the spring-damper controller of Braun's thesis (2009), chapter III, written to be read.

It is what `biped run` uses in compiled form, number for number. Change what you like and run it:

    biped run level_normal --set law=my_law.py:Law
    biped run level_normal --set law=my_law.py:Law --set randomise.runs=50 --set start.jitter=0.002
    biped diff normal my_law.py:Law --scenario level_normal --set randomise.runs=30 --set start.jitter=0.002

Signs, order, frames and units of everything here: docs/controllers.md.
"""

import numpy as np

TORSO, THIGH, HIP, KNEE, ANKLE = 0, (1, 4), (3, 6), (4, 7), (5, 8)  # links; coordinates: right leg, left leg
PITCH, STOP = 2, 8  # the torso's angle among the coordinates; first row of J that is a knee's


class Law:
    """Called once before every run with what is known, then a thousand times a second for six torques.

    Whatever it keeps in `self` lasts from tick to tick and is made anew for every run. What stands in `self.signals` is
    logged at every tick and appears in recordings, trajectories and tables.
    """

    def __init__(self, setup):
        if setup.gains.k_d1 is None:
            raise ValueError("this law needs the gains of a gait file and a planar biped of seven links")
        gains, actuation = setup.gains, setup.scenario.actuation
        self.torso = gains.k_d1, gains.b_d1, np.radians(gains.theta_b)
        self.k = np.array([gains.k_d2, gains.k_d3, gains.k_d4])  # (3, 4) [N m/rad] hip, knee, ankle; leg state 1 … 4
        self.b = np.array([gains.b_d2, gains.b_d3, gains.b_d4])  # (3, 4) [N m s/rad]
        self.theta_l, self.theta_a = np.radians(gains.theta_l), np.radians(gains.theta_a)
        self.theta_k = np.radians(gains.theta_k or (0.0,) * 4)  # straight, unless the gait says otherwise
        self.released = actuation.contacts == "released"
        self.pull, self.tolerance = actuation.release_force, actuation.rank_tolerance
        self.signals = {"contacts": 0.0, "wanted_torque": 0.0}

    def torques(self, sensed):
        """Six joint torques [N m]: hip, knee, ankle of the right leg, then of the left; limits are kept outside."""
        Q_d = self.springs(sensed)
        R = np.linalg.cholesky(sensed.M).T  # M = RᵀR
        C, rows = self.imposed(sensed, Q_d, R)
        u = self.nearest(C, R, Q_d)
        self.signals["contacts"] = sum(row % 2 == 0 for row in rows if row < STOP)
        self.signals["wanted_torque"] = float(np.abs(u).max())
        return u

    def springs(self, sensed):
        """Q_d (9,), (3.16)-(3.17): torso and thighs are held to the inertial frame, knees and ankles to their links."""
        k, b, theta = self.torso
        Q_d = np.zeros(9)
        Q_d[PITCH] = -k * (sensed.angle[TORSO] - theta) - b * sensed.rate[TORSO]
        for leg in range(2):
            s = sensed.state[leg] - 1
            k, b = self.k[:, s], self.b[:, s]
            thigh, hip, knee, ankle = THIGH[leg], HIP[leg], KNEE[leg], ANKLE[leg]
            Q_d[hip] = -k[0] * (sensed.angle[thigh] - self.theta_l[s]) - b[0] * sensed.rate[thigh]
            Q_d[knee] = -k[1] * (sensed.q[knee] - self.theta_k[s]) - b[1] * sensed.v[knee]
            Q_d[ankle] = -k[2] * (sensed.q[ankle] - self.theta_a[s]) - b[2] * sensed.v[ankle]
            Q_d[PITCH] += Q_d[hip]  # a thigh's angle is the torso's plus the hip's
        return Q_d

    def imposed(self, sensed, Q_d, R):
        """C = A R⁻¹ of the constraints that hold, and their rows: a point that would have to pull is let go."""
        rows = list(sensed.rows)
        free = np.linalg.solve(sensed.M, Q_d - sensed.h)  # accelerations without contacts
        while True:
            A = sensed.J[rows]
            C = np.linalg.solve(R.T, A.T).T
            if not rows or not self.released:
                return C, rows
            inverse = np.linalg.pinv(C, rcond=self.tolerance)
            force = inverse.T @ (inverse @ (sensed.b_v[rows] - A @ free))  # (3.6)-(3.7)
            normal = {row: f for row, f in zip(rows, force, strict=True) if row < STOP and row % 2 == 0}
            worst = min(normal, key=normal.__getitem__, default=None)
            if worst is None or normal[worst] >= -self.pull:
                return C, rows
            touching = sorted({row // 2 for row in rows if row < STOP} - {worst // 2})
            rows = sensed.rows_of(touching) + [row for row in rows if row >= STOP]

    def nearest(self, C, R, Q_d):
        """U of least norm among those that move the constrained robot as nearly as Q_d would, (3.15)."""
        _, size, V = np.linalg.svd(C)
        rank = int(np.sum(size > self.tolerance * size[0])) if size.size else 0
        free = V[rank:]  # rows that span what the constraints leave free: N = freeᵀ free
        E = np.vstack([np.zeros((3, 6)), np.eye(6)])
        moved = free @ np.linalg.solve(R.T, np.column_stack([E, Q_d]))
        return np.linalg.lstsq(moved[:, :6], moved[:, 6], rcond=self.tolerance)[0]
