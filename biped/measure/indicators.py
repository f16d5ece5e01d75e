"""EuroBench's performance indicators, by the names under which its benchmarks write them."""

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from biped.measure.balance import PHASES, Balance, balance, spells
from biped.measure.metrics.pushed import push_work
from biped.measure.signals import toes_and_heels
from biped.measure.trajectory import Trajectory
from biped.robot.gravity import GRAVITY
from biped.robot.planar.topology import HEEL

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
