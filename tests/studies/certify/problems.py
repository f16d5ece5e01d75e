"""Known problems made harder: scores that jump, falls that no level leads to, nothing to branch at."""

from __future__ import annotations

from biped.scenario.vary import stream
from biped.studies.certify.reference import Pendulum, Regulated


class Jumping(Regulated):
    """The regulated walk with a score that jumps: no more than whether a deviation was above a third of the bound."""

    def __call__(self, run):
        """The outcome of a run."""
        out = super().__call__(run)
        third = self._bound / 3.0
        return out._replace(rises=tuple((time, 0, float(value > third)) for time, _, value in out.rises))


class Capped(Regulated):
    """The regulated walk with a score that rises no further than three quarters of the bound."""

    def __call__(self, run):
        """The outcome of a run."""
        out = super().__call__(run)
        cap = 0.75 * self._bound
        return out._replace(rises=tuple((time, which, min(value, cap)) for time, which, value in out.rises))


class Trap(Regulated):
    """The regulated walk that falls besides, once in fifty runs, whatever it does."""

    def __call__(self, run):
        """The outcome of a run."""
        out = super().__call__(run)
        return out._replace(fell=True) if stream(run, "trap").uniform(0.0, 1.0) < 0.02 else out


class Timeless(Pendulum):
    """The pushed pendulum whose pushes are drawn all at once: none may be moved without the others."""

    def __call__(self, run):
        """The outcome of a run."""
        return Pendulum(self.foot)(run)

    def __init__(self, foot):
        super().__init__(foot)
        self.foot, self.times = foot, ()
