"""A control law of one's own: it holds the posture that it starts in."""

import biped


class Hold:
    """Springs and dampers on the six joints."""

    def __init__(self, setup):
        self.posture = None

    def torques(self, sensed):
        """Six joint torques [N m]."""
        if self.posture is None:
            self.posture = sensed.q[3:].copy()
        return 300.0 * (self.posture - sensed.q[3:]) - 30.0 * sensed.v[3:]


result = biped.run("level_normal", law=Hold, duration=1.5, **{"window.start": 0.5, "window.end": 1.5})
print(f"{result.trajectory.end} after {result.trajectory.time[-1]:.2f} s")
