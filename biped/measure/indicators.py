"""EuroBench's performance indicators, by the names under which its benchmarks write them.

Balance on level ground is among them: support phases, base of support, capture point, foot placement estimator, angular
momentum, as in EuroBench's indicators for humanoids (eb_hum_bench), in a plane.
"""

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from biped.measure.metrics.pushed import push_work
from biped.measure.signals import toes_and_heels
from biped.measure.trajectory import Trajectory
from biped.robot.ground import GRAVITY
from biped.robot.planar.topology import ENDS, HEEL, LEGS
from biped.robot.planar.tree import motion

FLIGHT, FL_SINGLE, FR_SINGLE, FL_DOUBLE, FR_DOUBLE = range(5)
"""Support phases: none; the left or the right foot alone; both, after the left or the right alone."""
PHASES = {
    "fl_single": FL_SINGLE, "fr_single": FR_SINGLE, "fl_double": FL_DOUBLE, "fr_double": FR_DOUBLE,
}  # fmt: skip
"""By EuroBench's names. The first leg is the right one."""


class Balance(NamedTuple):
    """Measures of balance, at every row.

    Attributes:
        phase: (n,) support phases.
        com: (n, 2) [m] centre of mass, forward and up.
        velocity: (n, 2) [m/s] of it.
        spin: (n,) [N m s] angular momentum about it, anticlockwise seen from the right.
        back: (n,) [m] rear end of the base of support; nan in flight.
        front: (n,) [m] its front end.
        capture: (n,) [m] capture point, where the linear inverted pendulum would come to rest.
        placement: (n,) [m] foot placement estimator; nan where there is none.
    """

    phase: np.ndarray
    com: np.ndarray
    velocity: np.ndarray
    spin: np.ndarray
    back: np.ndarray
    front: np.ndarray
    capture: np.ndarray
    placement: np.ndarray

    def inside(self, place: np.ndarray) -> np.ndarray:
        """(n,) [m] distance of places (n,) to the nearer end of the base of support, negative beyond it."""
        return np.minimum(place - self.back, self.front - place)

    @property
    def margin(self) -> np.ndarray:
        """(n,) [m] margin of stability: front of the base of support less the capture point (A. Hof, 2005)."""
        return self.front - self.capture


def balance(t: Trajectory) -> Balance:
    """Balance of a run on level ground."""
    whole = motion(t.tree, t.q, t.v)
    mass, total = t.tree.mass, float(t.tree.mass.sum())
    com, velocity = t.com[:, [0, 2]], t.com_velocity[:, [0, 2]]
    r, w = whole.com - com[:, None], whole.com_velocity - velocity[:, None]
    spin = whole.rate @ t.tree.inertia + (r[..., 0] * w[..., 1] - r[..., 1] * w[..., 0]) @ mass
    inertia = t.tree.inertia.sum() + (r**2).sum(axis=-1) @ mass
    on = t.down
    x = whole.point[..., 0].reshape(-1, LEGS, ENDS)
    standing = np.repeat(on[..., None], ENDS, axis=2)
    with np.errstate(all="ignore"):
        back = np.where(standing, x, np.inf).min(axis=(1, 2))
        front = np.where(standing, x, -np.inf).max(axis=(1, 2))
    air = ~(on[:, 0] | on[:, 1])
    back[air] = front[air] = np.nan
    capture = com[:, 0] + velocity[:, 0] * np.sqrt(np.maximum(com[:, 1], 0.0) / GRAVITY)
    placement = com[:, 0] + com[:, 1] * np.tan(placement_angle(total, inertia, com[:, 1], velocity, spin))
    return Balance(_phases(on), com, velocity, spin, back, front, capture, placement)


def _phases(on: np.ndarray) -> np.ndarray:
    """Support phases (n,) of feet (n, 2) on the ground, right and left; double support at the start is the right's."""
    out = np.full(len(on), FLIGHT)
    out[on[:, 0] & ~on[:, 1]] = FR_SINGLE
    out[on[:, 1] & ~on[:, 0]] = FL_SINGLE
    single = np.where(np.isin(out, (FL_SINGLE, FR_SINGLE)), np.arange(len(on)), -1)
    latest = np.maximum.accumulate(single)
    after_left = (latest >= 0) & (out[np.maximum(latest, 0)] == FL_SINGLE)
    both = on.all(axis=1)
    out[both] = np.where(after_left[both], FL_DOUBLE, FR_DOUBLE)
    return out


def placement_angle(
    mass: float, inertia: np.ndarray, height: np.ndarray, velocity: np.ndarray, spin: np.ndarray
) -> np.ndarray:
    """Angle [rad] from the vertical at which a foot brings the biped to rest upright over it, forward positive.

    The foot keeps the angular momentum about its place; what energy is left just suffices to reach the top (D. Wight,
    E. Kubica, D. Wang, J. Comput. Nonlinear Dyn. 3, 2008, equation (11)):

        [m h (v_x cos φ + v_z sin φ) + I θ̇ cos φ]² cos² φ / (m h² + I cos² φ) = 2 m g h cos φ (1 - cos φ)

    Args:
        mass: [kg].
        inertia: (n,) [kg m²] about the centre of mass.
        height: (n,) [m] of the centre of mass.
        velocity: (n, 2) [m/s] forward and up.
        spin: (n,) [N m s] I θ̇ anticlockwise.

    Returns:
        (n,) the smallest such angle; nan where there is none below 80°.
    """
    way = np.where(mass * height * velocity[:, 0] - spin < 0.0, -1.0, 1.0)
    forward, turning = way * velocity[:, 0], -way * spin

    def left(angle: np.ndarray) -> np.ndarray:
        c, s = np.cos(angle), np.sin(angle)
        kept = (mass * height * (forward * c + velocity[:, 1] * s) + turning * c) * c
        return kept**2 / (mass * height**2 + inertia * c * c) - 2.0 * mass * GRAVITY * height * c * (1.0 - c)

    low = np.zeros(len(height))
    high = np.full(len(height), np.nan)
    for angle in np.radians(np.arange(1.0, 81.0)):
        below = np.isnan(high) & (left(np.full(len(height), angle)) <= 0.0)
        high[below], low[below] = angle, angle - np.radians(1.0)
    for _ in range(40):
        middle = 0.5 * (low + high)
        beyond = left(middle) <= 0.0
        high, low = np.where(beyond, middle, high), np.where(beyond, low, middle)
    return way * high


def spells(phase: np.ndarray, which: int) -> list[slice]:
    """The spells of a support phase as slices of rows; those cut by the start or the end of the run are left out."""
    inside = np.concatenate([[False], phase == which, [False]])
    edges = np.flatnonzero(np.diff(inside.astype(int)))
    return [
        slice(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True) if a > 0 and b < len(phase)
    ]  # fmt: skip


LEAST_RUNS, MOST_FAILED = 10, 0.3
"""A disturbance counts as withstood if fewer than this share of at least so many runs fail."""


class Indicator(NamedTuple):
    """One indicator.

    Attributes:
        value: A number, or several.
        label: Of several: what each is.
    """

    value: float | list[float]
    label: tuple[str, ...] = ()


def of_run(t: Trajectory) -> dict[str, Indicator]:
    """Indicators of one run, by name; balance on level ground only, where it is defined."""
    speed = np.linalg.norm(t.com_velocity, axis=1)
    out = {
        "distance_travelled": Indicator(float(t.x[-1] - t.x[0])),
        "center_of_mass_avg_velocity": _spread(speed),
    }
    if t.link_speed is None:  # of whose links nothing is known
        return out
    if t.pushes:
        out["absorbed_energy"] = Indicator(push_work(t))
    if t.flat:
        out |= _of_balance(t, balance(t))
    return out


def _of_balance(t: Trajectory, b: Balance) -> dict[str, Indicator]:
    out: dict[str, Indicator] = {}
    force = t.foot_force.sum(axis=1)
    unit = t.mass * t.robot.leg * math.sqrt(GRAVITY * t.robot.leg)
    lasted = {}
    out["center_of_mass_average_normalized_ang_mom_all"] = _about_z(float(np.abs(b.spin).mean() / unit))
    for name, which in PHASES.items():
        found = spells(b.phase, which)
        lasted[name] = float(np.mean([(s.stop - s.start) * t.tick for s in found])) if found else math.nan
        if not found:
            continue
        out[f"vertical_impact_maximum_aggregated_{name}"] = _spread([force[s].max() for s in found])
        momentum = float(np.mean([np.abs(b.spin[s]).mean() for s in found]) / unit)
        out[f"center_of_mass_average_normalized_ang_mom_{name}"] = _about_z(momentum)
        for point, place in (("capture_point", b.capture), ("foot_placement_estimator", b.placement)):
            inside = b.inside(place)
            there = [part for s in found if len(part := inside[s][np.isfinite(inside[s])])]
            if there:
                out |= _against_support(point, name, there)
    steps = [row for row, _ in t.strikes]
    margins = [float(b.margin[row]) for row in steps if np.isfinite(b.margin[row])]
    if margins:
        out["margin_of_stability"] = Indicator(margins)
    real = {name: seconds for name, seconds in lasted.items() if math.isfinite(seconds)}
    if real:
        out["gait_phase_durations"] = Indicator(list(real.values()), tuple(real))
    return out


def _against_support(point: str, phase: str, inside: Sequence[np.ndarray]) -> dict[str, Indicator]:
    """Distances [m] of a point to the base of support over the spells of a phase, positive inside."""
    positive = [100.0 * float((part >= 0.0).mean()) for part in inside]
    lowest, highest = (_spread([float(of(part)) for part in inside]).value for of in (np.min, np.max))
    share = _spread(positive).value
    assert isinstance(lowest, list)
    assert isinstance(highest, list)
    assert isinstance(share, list)
    return {
        f"{point}_average_bos_dist_{phase}": _spread([float(part.mean()) for part in inside]),
        f"{point}_min_max_bos_dist_{phase}": Indicator(
            [*lowest, *highest], ("min_mean", "min_std", "max_mean", "max_std")
        ),
        f"{point}_percentage_bos_dist_{phase}": Indicator(
            [share[0], share[1], 100.0 - share[0], share[1]],
            ("inside_mean", "inside_std", "outside_mean", "outside_std"),
        ),
    }  # fmt: skip


def _spread(values: Sequence[float] | np.ndarray) -> Indicator:
    """Mean and standard deviation, of a single value 0."""
    return Indicator(
        [float(np.mean(values)), float(np.std(values, ddof=1)) if len(values) > 1 else 0.0], ("mean", "std")
    )


def _about_z(value: float) -> Indicator:
    return Indicator([0.0, 0.0, value], ("x", "y", "z"))


def of_campaign(result: Mapping[str, Any], impulse: Mapping[int, float]) -> dict[str, Indicator]:
    """Indicators of many runs: the share that fell, and the largest disturbance that is withstood.

    Args:
        result: The result object.
        impulse: [N s] size of the push of each run by its number, for runs that are pushed.
    """
    runs = result["runs"]
    failed = {run["index"]: bool(run["fell"]) or run["end"] != "completed" or bool(run.get("doubtful")) for run in runs}
    out = {"fall_percentage": Indicator(100.0 * sum(bool(run["fell"]) for run in runs) / len(runs))}
    levels: dict[float, list[bool]] = {}
    for index, size in impulse.items():
        levels.setdefault(round(abs(size), 9), []).append(failed[index])
    withstood = [
        size for size, of in levels.items() if len(of) >= LEAST_RUNS and sum(of) < MOST_FAILED * len(of)
    ]  # fmt: skip
    if withstood:
        out["Stability_margin"] = Indicator(max(withstood))
    return out


def gait_events(t: Trajectory) -> dict[str, list[float]]:
    """Heel strikes and toe offs [s] by EuroBench's labels: a foot comes down, and leaves the ground."""
    out: dict[str, list[float]] = {}
    for leg, side in enumerate("rl"):
        down = t.down[:, leg]
        came = [row for row, which in t.strikes if which == leg]
        lifts = np.flatnonzero(down[:-1] & ~down[1:]) + 1
        left = [int(lifts[lifts < row][-1]) for row in came if (lifts < row).any()]
        out[f"{side}_heel_strike"] = [float(t.time[row]) for row in came]
        out[f"{side}_toe_off"] = [float(t.time[row]) for row in left]
    return out


def gait_parameters(t: Trajectory) -> dict[str, float]:
    """EuroBench's gait parameters by label (its spelling), means over the run; one that does not exist is left out."""
    steps = t.strikes
    point = toes_and_heels(t)
    b = balance(t) if t.flat and t.link_speed is not None else None
    out: dict[str, float] = {}
    for leg, side in ((1, "left"), (0, "right")):
        own = [row for row, which in steps if which == leg]
        times, places = t.time[own], point[own][:, HEEL[leg], 0]
        pairs = [(a, c) for (a, first), (c, second) in pairwise(steps)
                 if second == leg and first != leg]  # fmt: skip
        if len(own) > 1:
            stride, length = float(np.diff(times).mean()), float(np.diff(places).mean())
            out |= {f"cadence_{side}": 120.0 / stride, f"walking_speed_{side}": length / stride,
                    f"stride_time_{side}": stride, f"stride_length_{side}": length}  # fmt: skip
        if pairs:
            out[f"step_time_{side}"] = float(np.mean([t.time[c] - t.time[a] for a, c in pairs]))
            heel, other = point[own][:, HEEL[leg], 0], point[own][:, HEEL[1 - leg], 0]
            out[f"step_length_{side}"] = float((heel - other).mean())
        if b is not None:
            single = spells(b.phase, PHASES["fl_single" if leg == 1 else "fr_single"])
            if single:
                out[f"single_suport_{side}"] = float(np.mean([(s.stop - s.start) * t.tick for s in single]))
    if b is not None:
        double = [s for name in ("fl_double", "fr_double") for s in spells(b.phase, PHASES[name])]
        if double:
            out["double_support"] = float(np.mean([(s.stop - s.start) * t.tick for s in double]))
    return out
