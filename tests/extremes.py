"""Walks that nobody should ask for: random scenarios far outside of what walks, from a seed."""

from __future__ import annotations

import numpy as np

BASES = ("level_normal", "level_normal_generalized", "level_fast", "robust/own", "home")


def _log(low: float, high: float):
    return lambda rng: float(f"{10.0 ** rng.uniform(np.log10(low), np.log10(high)):.4g}")


def _signed(low: float, high: float):
    return lambda rng: float(rng.choice([-1.0, 1.0])) * _log(low, high)(rng)


def _one_of(*values):
    return lambda rng: values[int(rng.integers(len(values)))]


def _seven(low: float, high: float):
    return lambda rng: [_log(low, high)(rng) if rng.random() < 0.3 else 1.0 for _ in range(7)]


KEYS = {
    "ground.contact_time": _log(2e-3, 0.3),
    "ground.damping_ratio": _log(1e-3, 100.0),
    "ground.friction": _log(1e-4, 1e3),
    "ground.slope": _signed(0.1, 44.0),
    "simulation.iterations": _one_of(1, 2, 3, 5),
    "simulation.tolerance": _log(1e-8, 10.0),
    "simulation.impratio": _log(1e-2, 1e5),
    "simulation.integrator": _one_of("RK4", "implicit", "implicitfast", "discrete"),
    "simulation.cone": _one_of("pyramidal"),
    "sensors.delay": _log(1e-3, 1.0),
    "sensors.angle_noise": _log(1e-4, 10.0),
    "sensors.rate_noise": _log(1e-3, 100.0),
    "sensors.quantisation": _log(1e-4, 1.0),
    "actuation.torque_limit": _log(1e-2, 1e5),
    "actuation.lag": _log(1e-4, 1.0),
    "actuation.release_force": _log(1e-3, 1e5),
    "truth.joint_damping": _log(1e-2, 1e4),
    "truth.mass": _seven(1e-3, 1e3),
    "truth.inertia": _seven(1e-2, 1e2),
    "truth.length": _seven(0.5, 2.0),
    "gains.k_d2": lambda rng: [_log(1.0, 1e6)(rng) for _ in range(4)],
    "gains.b_d2": lambda rng: [_log(1e-2, 1e5)(rng) for _ in range(4)],
    "gains.k_d1": _log(1.0, 1e6),
    "start.v": lambda rng: [_signed(0.1, 100.0)(rng) if rng.random() < 0.3 else 0.0 for _ in range(9)],
    "push": lambda rng: f"[{{at=0.2,duration=0.2,force={[_signed(1.0, 1e5)(rng) for _ in range(2)]}}}]",
}  # fmt: skip
RATES = ((2e-3, 500.0), (1e-3, 500.0), (1e-3, 200.0), (5e-3, 200.0), (2.5e-4, 1000.0))


def extreme(number: int, seconds: float = 1.5) -> tuple[str, list[str]]:
    """Scenario and changes of extreme walk `number`: one to four keys far from their defaults."""
    rng = np.random.default_rng([2009, number])
    name = BASES[int(rng.integers(len(BASES)))]
    keys = rng.choice(list(KEYS), size=int(rng.integers(1, 5)), replace=False)
    changes = [f"{key}={KEYS[key](rng)}" for key in keys]
    if rng.random() < 0.2:
        step, rate = RATES[int(rng.integers(len(RATES)))]
        changes += [f"simulation.timestep={step}", f"simulation.control_rate={rate}"]
    if rng.random() < 0.25:
        changes.append("engine=home")
    return name, [f"duration={seconds}", "window.start=0.5", f"window.end={seconds}", "sweep={}", *changes]
