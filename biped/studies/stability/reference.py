"""Walkers whose cycles and multipliers are published: what `biped stability` is validated on.

Both are passive, walk down a slope and are integrated by an 8th-order Runge-Kutta method whose events are located on
its dense output.
"""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

from biped.base.errors import RunError
from biped.studies.stability.cycle import Cycle, find_cycle, pairs, sorted_multipliers

_TOLERANCE = 1e-13
_LONGEST = 20.0
# [rad] The stance leg is further behind the vertical than this when the swing foot lands.
_SCUFF = -0.05


def _until(rate: Callable, state: np.ndarray, event: Callable) -> np.ndarray:
    """The state where `event` rises through zero."""
    event.terminal, event.direction = True, 1.0
    found = solve_ivp(rate, (0.0, _LONGEST), state, method="DOP853", rtol=_TOLERANCE, atol=_TOLERANCE, events=event)
    if found.status != 1:
        raise RunError(f"the walker took no step within {_LONGEST:g} time units from {state.tolist()}")
    return found.y_events[0][0]


class RimlessWheel(NamedTuple):
    """A hub with massless spokes, l = g = 1 (T. McGeer, Int. J. Robotics Research 9(2), 1990).

    Its state is the rate ω just after a spoke has landed. Between landings ω² grows by 4 sin α sin γ; a landing keeps
    cos 2α of ω: the fixed point and the multiplier cos² 2α are known in closed form.

    Attributes:
        alpha: Half the angle between spokes [rad].
        gamma: Slope [rad].
    """

    alpha: float = math.pi / 8
    gamma: float = 0.08

    def step(self, z: np.ndarray) -> np.ndarray:
        """ω (1,) after the next landing."""
        start = np.array([self.gamma - self.alpha, z[0]])

        def rate(_t, y):
            return np.array([y[1], math.sin(y[0])])

        def landing(_t, y):
            return y[0] - self.gamma - self.alpha

        return np.array([math.cos(2.0 * self.alpha) * _until(rate, start, landing)[1]])

    def exact(self) -> tuple[np.ndarray, np.ndarray]:
        """Fixed point (1,) and multiplier (1,) in closed form."""
        kept = math.cos(2.0 * self.alpha) ** 2
        gained = 4.0 * math.sin(self.alpha) * math.sin(self.gamma)
        return np.array([math.sqrt(kept * gained / (1.0 - kept))]), np.array([kept])


class SimplestWalker(NamedTuple):
    """Two massless legs, a mass at the hip, feet of vanishing mass, l = g = 1.

    M. Garcia, A. Chatterjee, A. Ruina, M. Coleman: The simplest walking model: stability, complexity, and scaling,
    J. Biomech. Eng. 120 (1998) 281-288. Its state is the stance leg's angle θ and rate just after heel strike, which
    fix those of the swing leg.

    Attributes:
        gamma: Slope [rad].
    """

    gamma: float = 0.009

    def step(self, z: np.ndarray) -> np.ndarray:
        """(θ, θ̇) after the next heel strike."""
        theta, rate_0 = z
        start = np.array([theta, rate_0, 2.0 * theta, (1.0 - math.cos(2.0 * theta)) * rate_0])

        def rate(_t, y):
            theta, omega, phi, omega_phi = y
            turn = math.sin(theta - self.gamma)
            swing = turn + math.sin(phi) * (omega**2 - math.cos(theta - self.gamma))
            return np.array([omega, turn, omega_phi, swing])

        def heel_strike(_t, y):
            # The swing foot also meets the ground as the legs pass each other; that scuffing is ignored.
            return -1.0 if y[0] > _SCUFF else y[2] - 2.0 * y[0]

        at = _until(rate, start, heel_strike)
        return np.array([-at[0], math.cos(2.0 * at[0]) * at[1]])


class Published(NamedTuple):
    """A cycle of the simplest walker as its authors' released program (pointfoot, 1998) states it, γ = 0.009.

    They took one-sided differences of 1e-5, which the multipliers show in their third digit.

    Attributes:
        name: Which cycle.
        state: (θ, θ̇) just after heel strike.
        multipliers: As printed.
        digits: Decimal places printed.
    """

    name: str
    state: tuple[float, float]
    multipliers: tuple[complex, complex]
    digits: int


PUBLISHED = (
    Published(
        "long period",
        (0.20031090049483, -0.19983247291764),
        (-0.19120868949940 + 0.55633363687106j, -0.19120868949940 - 0.55633363687106j),
        14,
    ),
    Published("short period", (0.19393736960624, -0.20386692731962), (4.000, 0.459), 3),
)

PUBLISHED_DIFFERENCE = 1e-5

_DIFFERENCE = 3e-5
"""Central differences whose truncation and rounding errors are both below 1e-8 here."""


def one_sided(walker: SimplestWalker, state: tuple[float, float]) -> np.ndarray:
    """Multipliers (2,) by one-sided differences, as those published were found."""
    z = np.array(state)
    steps = PUBLISHED_DIFFERENCE * np.eye(2)
    columns = [(walker.step(z + e) - walker.step(z)) / PUBLISHED_DIFFERENCE for e in steps]
    return sorted_multipliers(np.column_stack(columns))


class Known(NamedTuple):
    """A cycle as found and as known.

    Attributes:
        cycle: What is found.
        state: Known state just after the landing.
        multipliers: Known multipliers.
        alike: Multipliers found in the way of the known ones.
    """

    cycle: Cycle
    state: np.ndarray
    multipliers: np.ndarray
    alike: np.ndarray

    def as_dict(self) -> dict[str, Any]:
        """Plain data, as `--json` prints it."""
        return {
            "state": self.cycle.state.tolist(),
            "known_state": self.state.tolist(),
            "multipliers": pairs(self.cycle.multipliers),
            "error": self.cycle.error.tolist(),
            "known_multipliers": pairs(self.multipliers),
            "multipliers_found_as_known": pairs(self.alike),
            "stable": self.cycle.stable,
        }


def solve_all() -> dict[str, Known]:
    """Every reference cycle by name: what is found, and what is known of it."""
    wheel = RimlessWheel()
    found = find_cycle(wheel.step, np.array([0.4]), step=_DIFFERENCE)
    out = {"rimless wheel": Known(found, *wheel.exact(), found.multipliers)}
    walker = SimplestWalker()
    for known in PUBLISHED:
        cycle = find_cycle(walker.step, np.array(known.state), step=_DIFFERENCE)
        alike = one_sided(walker, known.state)
        state, multipliers = np.array(known.state), np.array(known.multipliers)
        out[f"simplest walker, {known.name}"] = Known(cycle, state, multipliers, alike)
    return out
