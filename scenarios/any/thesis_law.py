"""The thesis's law on the general path: from what any robot senses to torques, in readable Python.

`biped.control.planar.start_law` is the law itself, number for number; here is what it needs to know of a planar biped
of seven links, read from what the general path senses. Whoever has another robot begins here.
"""

import numpy as np

from biped.control.planar.start_law import Law as Thesis

KNEES = (4, 7)
TOES = (0, 2)  # of the four contact points; each heel follows its toe


class Law(Thesis):
    """Springs by leg state, and torques that move the robot on the ground as they would."""

    def __init__(self, setup):
        super().__init__(setup)
        sensing = setup.scenario.sensing
        self.sensing = sensing
        hold = (sensing.toe_on, sensing.toe_off), (sensing.heel_on, sensing.heel_off)
        self.hold = [[round(time / setup.tick) for time in hold[i % 2]] for i in range(4)]
        self.believed = self.waiting = None

    def torques(self, sensed):
        """(6,) [N m]."""
        return super().torques(self.seen(sensed))

    def seen(self, sensed):
        """What the law reads: link angles, leg states, and rows of A."""
        q, v = sensed.q, sensed.v
        self.time, self.q, self.v, self.M, self.h = sensed.time, q, v, sensed.M, sensed.h
        self.angle, self.rate = links(q) + np.pi * np.array([0.5, 0.5, 0.5, 0.0, 0.5, 0.5, 0.0]), links(v)
        near = sensed.height < self.sensing.contact_height
        self.believe(near)
        self.state = [self.leg_state(leg) for leg in range(2)]
        stops = [-q[knee] < self.sensing.knee_angle for knee in KNEES]
        self.touching = np.array([*near, *stops], dtype=int)
        # Rows of A: of each point normal, then tangential; then the knees'.
        self.J, self.b_v = np.zeros((10, 9)), np.zeros(10)
        rows = [3 * point + direction for point in range(4) for direction in (2, 0)]
        self.J[:8], self.b_v[:8] = sensed.J[rows], sensed.b[rows]
        self.J[[8, 9], KNEES] = 1.0
        return self

    def believe(self, near):
        """A contact counts once it has lasted, and so does its end."""
        if self.believed is None:
            self.believed, self.waiting = near.copy(), [0] * 4
        for i in range(4):
            self.waiting[i] = 0 if near[i] == self.believed[i] else self.waiting[i] + 1
            if self.waiting[i] >= self.hold[i][0 if near[i] else 1] and self.waiting[i]:
                self.believed[i], self.waiting[i] = near[i], 0

    def leg_state(self, leg):
        """1 stance, 2 push-off, 3 swing, 4 swing with the knee extended (Fig 3.3)."""
        toe, heel = self.believed[TOES[leg]], self.believed[TOES[leg] + 1]
        thigh, other = self.angle[1 + 3 * leg], self.angle[4 - 3 * leg]
        if heel:
            return 1
        if toe:
            return 1 if thigh > np.radians(self.sensing.late_stance) else 2
        extended = self.q[KNEES[leg]] > -self.sensing.extended and thigh - other > self.sensing.ahead
        return 4 if extended else 3

    @property
    def rows(self):
        """Rows of whatever touches."""
        points = [i for i in range(4) if self.touching[i]]
        return self.rows_of(points) + [8 + i for i in range(2) if self.touching[4 + i]]

    def rows_of(self, points):
        """Rows of some points, normal and tangential."""
        return [2 * point + direction for point in points for direction in range(2)]


def links(q):
    """(7,) angles of the links, or rates, from coordinates (9,): each is the one before it plus its joint."""
    pitch = q[2]
    return np.array([pitch, *(pitch + np.cumsum(q[3:6])), *(pitch + np.cumsum(q[6:9]))])
