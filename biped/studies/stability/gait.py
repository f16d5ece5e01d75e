"""Measurements of a gait, place by place: an engine at a time step."""

from typing import Any, NamedTuple

from biped.studies.stability.basin import Basin, Shrinking
from biped.studies.stability.cycle import Fit, pairs
from biped.studies.stability.orbit import Exponent, Orbit


class KickedFit(NamedTuple):
    """The linear map fitted to returns of kicked walks.

    Attributes:
        fit: The map.
        kick: Standard deviation of the kicks in every direction, natural units.
        fell: Kicked walks that fell, of `walks`.
        walks: Kicked walks.
    """

    fit: Fit
    kick: float
    fell: int
    walks: int

    @property
    def stable(self) -> bool:
        """Whether the whole interval of the largest multiplier is below one."""
        return self.fit.interval[1] < 1.0

    def as_dict(self) -> dict[str, Any]:
        """Numbers by name."""
        return {
            "kick": self.kick,
            "fell": self.fell,
            "walks": self.walks,
            "radius": self.fit.radius,
            "interval": list(self.fit.interval),
            "explained": self.fit.explained,
            "multipliers": pairs(self.fit.multipliers),
            "stable": self.stable,
        }


class MeasuredGait(NamedTuple):
    """A gait in one place.

    Attributes:
        section: Where strides are cut, in words.
        walks: Steady walks.
        fell: How many of them fell.
        strides: Strides they took.
        period: [s] mean of a stride.
        period_std: [s].
        spread: Root of the summed variances of the section states, natural units.
        kind: What the gait is to small disturbances, in words.
        exponent: Lyapunov exponent; None if the return map cannot be repeated.
        orbit: The nearest periodic orbit; None if none was looked at.
        sizes: What becomes of kicks of every size.
        floor: Size above which kicks have shrunk, 0 if all have; None if none has.
        kicked: The linear map of finite kicks.
        basin: A slice of the basin of attraction, if it was cut.
    """

    section: str
    walks: int
    fell: int
    strides: int
    period: float
    period_std: float
    spread: float
    kind: str
    exponent: Exponent | None
    orbit: Orbit | None
    sizes: list[Shrinking]
    floor: float | None
    kicked: KickedFit
    basin: Basin | None

    def as_dict(self) -> dict[str, Any]:
        """Numbers by name."""
        out = self._asdict() | {
            "exponent": None if self.exponent is None else self.exponent._asdict(),
            "orbit": None if self.orbit is None else _orbit_dict(self.orbit),
            "sizes": [row._asdict() for row in self.sizes],
            "fit": self.kicked.as_dict(),
        }
        del out["kicked"], out["basin"]
        return out if self.basin is None else out | {"basin": self.basin.as_dict()}


class Gait(NamedTuple):
    """A gait in an engine at a time step.

    Attributes:
        engine: The engine.
        timestep: [s].
        measured: What was measured; None if there is no steady gait.
        failed: Why there is none.
    """

    engine: str
    timestep: float
    measured: MeasuredGait | None
    failed: str = ""

    @property
    def place(self) -> str:
        """Where it was measured, in words."""
        return f"{self.engine}, {1e3 * self.timestep:g} ms"

    def as_dict(self) -> dict[str, Any]:
        """Numbers by name, or `failed`."""
        found = {"failed": self.failed} if self.measured is None else self.measured.as_dict()
        return {"engine": self.engine, "timestep": self.timestep, **found}


class Studied(NamedTuple):
    """A scenario's gait in every place.

    Attributes:
        scenario: Its name.
        gaits: One of each place.
    """

    scenario: str
    gaits: list[Gait]

    @property
    def stable(self) -> bool:
        """Whether kicks die out on average in every place."""
        return all(gait.measured is not None and gait.measured.kicked.stable for gait in self.gaits)

    def as_dict(self) -> dict[str, Any]:
        """Plain data, as `--json` prints it."""
        return {"scenario": self.scenario, "gaits": [gait.as_dict() for gait in self.gaits], "stable": self.stable}


def _orbit_dict(orbit: Orbit) -> dict[str, Any]:
    cycle = orbit.cycle
    return {
        "returns": orbit.returns,
        "moved": orbit.moved,
        "residual": None if cycle is None else cycle.residual,
        "multipliers": None if cycle is None else pairs(cycle.multipliers),
        "error": None if cycle is None else cycle.error.tolist(),
    }
