"""The metrics again, from whole arrays at once: the referee of the compiled pass over rows."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np

from biped.measure.trajectory import Trajectory
from biped.robot.ground import GRAVITY, gravity
from biped.robot.planar.topology import ANKLE, BASE, HEEL, HIP, KNEE, LEGS, NQ, PITCH, SEGMENTS, THIGH, TOE, TORSO
from biped.robot.planar.tree import Motion, motion


def numbers(t: Trajectory, window: tuple[float, float]) -> dict[str, Any]:
    """All metrics but the outcome and the cycle of leg states, of a run in which nothing is too fast."""
    whole = motion(t.tree, t.q, t.v)
    squared = (whole.com_velocity**2).sum(axis=-1)
    inside = np.flatnonzero((t.time >= window[0] - 1e-9) & (t.time <= window[1] + 1e-9))
    out = {
        "energy_residual": residual(t, whole), "energy_from_nowhere": from_nowhere(t, whole),
        "momentum_residual": momentum_residual(t, whole), "penetration": max(0.0, -whole.point[..., 1].min()),
        "peak_force": t.column("force")[..., 1].max(), "peak_foot_force": peak_foot_force(t),
        "peak_torque": np.abs(t.u).max(), "link_speed": np.sqrt(squared.max()),
    }  # fmt: skip
    if len(inside) > 1:
        span = slice(inside[0], inside[-1] + 1)
        out |= stride(t, whole, span) | transport(t, whole, span) | contact(t, whole, span)
        out["per_joint"] = per_joint(t, span)
    return out


def peak_foot_force(t: Trajectory) -> float:
    normal = t.column("force")[..., 1]
    return float(max((normal[:, toe] + normal[:, heel]).max() for toe, heel in zip(TOE, HEEL, strict=True)))


def _steps(t: Trajectory) -> tuple[np.ndarray, Motion]:
    mean = 0.5 * (t.v[:-1] + t.v[1:])
    return mean, motion(t.tree, t.q[:-1], mean)


def _push_power(t: Trajectory, moved: Motion) -> np.ndarray:
    power = np.zeros(len(t) - 1)
    for first, last, force, at in _pushes(t):
        power[first:last] += moved.com_velocity[first:last, at] @ force
    return power


def _pushes(t: Trajectory) -> list[tuple[int, int, np.ndarray, int]]:
    c, s = math.cos(math.radians(t.slope)), math.sin(math.radians(t.slope))
    return [
        (round(start / t.tick), round(end / t.tick), np.array([forward * c + up * s, up * c - forward * s]),
         t.robot.bodies.index(body))
        for start, end, forward, up, body in t.pushes if body in t.robot.bodies
    ]  # fmt: skip


def residual(t: Trajectory, whole: Motion) -> float:
    if len(t) < 2:
        return 0.0
    mean, moved = _steps(t)
    applied = t.Q_d[:-1] if t.generalized else t.u[:-1]
    actuators = np.einsum("ij,ij->i", applied, mean[:, NQ - applied.shape[1] :])
    pushes = _push_power(t, moved)
    stops = t.stop[:-1, 0] * mean[:, KNEE[0]] + t.stop[:-1, 1] * mean[:, KNEE[1]]
    damping = -np.einsum("j,ij,ij", t.tree.damping, mean[:, BASE:], mean[:, BASE:])
    ground = np.einsum("ijk,ijk", t.column("force")[:-1], moved.point_velocity)
    e = energy(t, whole)[[0, -1]]
    work = t.tick * ((actuators + pushes + stops).sum() + damping + ground)
    put_in = t.tick * (np.abs(actuators) + np.abs(pushes)).sum()
    moving = 0.5 * ((whole.com_velocity**2).sum(axis=-1) @ t.tree.mass).max()
    return float(abs(e[1] - e[0] - work) / max(put_in, moving, t.tree.mass.sum() * GRAVITY * t.tree.leg))


def given(t: Trajectory, whole: Motion) -> np.ndarray:
    """(n - 1,) [J] of actuators and pushes."""
    applied = t.Q_d[:-1] if t.generalized else t.u[:-1]
    put_in = np.einsum("ij,ij->i", applied, np.diff(t.q[:, NQ - applied.shape[1] :], axis=0))
    for first, last, force, at in _pushes(t):
        put_in[first:last] += np.diff(whole.com[:, at], axis=0)[first:last] @ force
    return put_in


def energy(t: Trajectory, whole: Motion) -> np.ndarray:
    """(n,) [J] kinetic and potential."""
    moving = 0.5 * ((whole.com_velocity**2).sum(axis=-1) @ t.tree.mass)
    spinning = 0.5 * (whole.rate**2 @ t.tree.inertia + t.v[:, BASE:] ** 2 @ t.tree.armature)
    return moving + spinning - (t.tree.mass @ whole.com) @ np.array(gravity(t.slope))


def from_nowhere(t: Trajectory, whole: Motion) -> float:
    if len(t) < 2:
        return 0.0
    put_in, total = given(t, whole), energy(t, whole)
    moving = 0.5 * ((whole.com_velocity**2).sum(axis=-1) @ t.tree.mass)
    most = (total[1:] - total[0] - np.cumsum(put_in)).max()
    return float(max(most, 0.0) / max(np.abs(put_in).sum(), moving.max(), 0.1 * abs(total[0])))


def transport(t: Trajectory, whole: Motion, span: slice) -> dict[str, float]:
    u, rate = t.u[span], t.v[span, BASE:]
    weight = float(t.tree.mass.sum()) * GRAVITY * travelled(t, span) / t.tick
    if t.generalized:
        # Q_d's virtual actuators: torso and thighs to the inertial frame, knees and ankles between links.
        Q, v = t.Q_d[span], t.v[span]
        rates = whole.rate[span]
        torso = Q[:, PITCH] - Q[:, HIP[0]] - Q[:, HIP[1]]
        u = np.column_stack([torso, Q[:, HIP], Q[:, KNEE], Q[:, ANKLE]])
        rate = np.column_stack([rates[:, TORSO], rates[:, THIGH], v[:, KNEE], v[:, ANKLE]])
    power = u[:-1] * (rate[:-1] + rate[1:]) / 2.0
    step = np.diff(whole.point[span], axis=0)
    ground = (t.column("force")[span][:-1] * step).sum(axis=(1, 2)) / t.tick
    acted = t.u[: -1 if t.end == "fell" else None][span]
    jumps = np.abs(np.diff(acted, axis=0)).max(axis=1)
    return {
        "cost_of_transport": float(np.abs(power.sum(axis=1)).sum() / weight),
        "cost_of_transport_absolute": float(np.abs(power).sum() / weight),
        "cost_of_transport_positive": float(np.maximum(power, 0.0).sum() / weight),
        "mean_torque": float(np.abs(t.u[span]).mean()),
        "peak_power": float(np.abs(u * rate).max()),
        "torque_rate": float(jumps.mean() * 1e-3 / t.tick),
        "torque_rate_99": float(np.percentile(jumps, 99.0) * 1e-3 / t.tick),
        "torque_jump": float(jumps.max()),
        "saturation": float((np.abs(t.u[span]) >= np.array(t.torque_limit)).any(axis=1).mean()),
        "contact_loss": float(-ground.mean()),
    }


def per_joint(t: Trajectory, span: slice) -> dict[str, dict[str, float]]:
    u, power = np.abs(t.u[span]), np.abs(t.u[span] * t.v[span, BASE:])
    return {
        name: {
            "peak_torque": float(u[:, [i, i + SEGMENTS]].max()),
            "mean_torque": float(u[:, [i, i + SEGMENTS]].mean()),
            "peak_power": float(power[:, [i, i + SEGMENTS]].max()),
        }
        for i, name in enumerate(("hip", "knee", "ankle"))
    }


def travelled(t: Trajectory, span: slice) -> float:
    distance = abs(float(t.q[span, 0][-1] - t.q[span, 0][0]))
    return distance if distance >= 0.1 else math.nan


def stride(t: Trajectory, whole: Motion, span: slice) -> dict[str, float]:
    x, vx, time = t.q[span, 0], t.v[span, 0], t.time[span]
    seconds = float(time[-1] - time[0]) or math.nan  # a run that ended in its first tick has no rates
    speed = float(x[-1] - x[0]) / seconds
    phase, active = t.phase[span], t.active[span]
    down = standing(t)
    steps = [step for step in strikes(down, t.tick) if span.start <= step[0] < span.stop]
    place = whole.point[:, :, 0]
    legs = [leg for _, leg in steps]
    lengths = [abs(place[row, HEEL[leg]] - place[row, HEEL[1 - leg]]) for row, leg in steps]
    right, left = down[span].T
    lean = -np.degrees(t.q[span, PITCH]) - t.slope
    return {
        "speed": speed,
        "speed_std": float(np.std(vx)),
        "froude": speed / math.sqrt(GRAVITY * t.tree.leg),
        "step_length": float(np.mean(lengths)) if lengths else math.nan,
        "step_frequency": (len(steps) - 1) / (t.tick * (steps[-1][0] - steps[0][0])) if len(steps) > 1 else 0.0,
        "steps": len(steps),
        "alternation": float(np.mean([a != b for a, b in pairwise(legs)])) if len(legs) > 1 else math.nan,
        "step_duration": float(np.mean([t.tick * (b - a) for (a, _), (b, _) in pairwise(steps)]))
        if len(legs) > 1
        else math.nan,
        "duty": float(0.5 * (np.mean(right) + np.mean(left))),
        "strayed": float(np.abs(x - x.mean()).max()),
        "double_support": float(np.mean(right & left)),
        "flight": float(np.mean(~right & ~left)),
        "torso_lean": float(np.mean(lean)),
        "torso_sway": float(np.std(lean)),
        "switches": float(np.count_nonzero(np.diff(phase, axis=0))) / seconds,
        "constraint_switches": float(np.count_nonzero(np.diff(active, axis=0).any(axis=1))) / seconds,
    }


def contact(t: Trajectory, whole: Motion, span: slice) -> dict[str, float]:
    normal = t.column("force")[span, :, 1]
    distance = travelled(t, span)
    sliding, pressure = 0.0, []
    for toe, heel in zip(TOE, HEEL, strict=True):
        for row in range(len(normal)):
            total = normal[row, toe] + normal[row, heel]
            if total <= 0.01 * t.mass * 9.81:
                continue
            pressure.append(normal[row, toe] / total)
            if row + 1 < len(normal):
                here, there = whole.point[span][row], whole.point[span][row + 1]
                moved = np.abs(there - here)[:, 0]
                sliding += (normal[row, toe] * moved[toe] + normal[row, heel] * moved[heel]) / total
    weight = float(t.tree.mass.sum()) * -gravity(t.slope)[1]
    return {
        "support": float(normal.sum(axis=1).mean() / weight),
        "centre_of_pressure": float(np.mean(pressure)) if pressure else math.nan,
        "slip": float(sliding / distance),
        "clearance": _clearance(t, whole, span),
    }


def _clearance(t: Trajectory, whole: Motion, span: slice) -> float:
    lowest, least, down = math.nan, round(0.1 / t.tick), standing(t)[span]
    for leg in range(LEGS):
        for start, end in spells(~down[:, leg]):
            if end - start < least or start == 0 or end == len(down):
                continue
            quarter = (end - start) // 4
            height = whole.point[span, TOE[leg] : HEEL[leg] + 1, 1][start + quarter : end - quarter].min()
            lowest = float(np.fmin(lowest, height))
    return lowest


def spells(on: np.ndarray) -> list[tuple[int, int]]:
    edges = np.diff(np.concatenate([[0], on.astype(int), [0]]))
    return list(zip(np.flatnonzero(edges > 0).tolist(), np.flatnonzero(edges < 0).tolist(), strict=True))


def standing(t: Trajectory) -> np.ndarray:
    """(n, 2) feet on the ground: above 1 % of the weight, gaps and touches of less than 50 ms aside."""
    least, n = round(0.05 / t.tick), len(t)
    down = np.stack([t.column("force")[:, [toe, heel], 1].sum(axis=1) > 0.01 * t.mass * 9.81
                     for toe, heel in zip(TOE, HEEL, strict=True)], axis=1)  # fmt: skip
    for leg in range(LEGS):
        for value in (False, True):
            for start, end in spells(down[:, leg] == value):
                if end - start < least and start > 0 and end < n:
                    down[start:end, leg] = not value
    return down


def strikes(down: np.ndarray, tick: float) -> list[tuple[int, int]]:
    return sorted(
        (end, leg) for leg in range(LEGS) for start, end in spells(~down[:, leg])
        if end < len(down) and end - start >= round(0.05 / tick)
    )  # fmt: skip


def momentum_residual(t: Trajectory, whole: Motion) -> float:
    if len(t) < 2:
        return 0.0
    momentum = (t.tree.mass * whole.com_velocity[[0, -1], :, 1]).sum(axis=1)
    force = float(t.column("force")[:-1, :, 1].sum())
    weight = -float(t.tree.mass.sum()) * gravity(t.slope)[1]
    push, pushed, count = 0.0, 0.0, len(t) - 1
    angle = math.radians(t.slope)
    for start, end, forward, up, _ in t.pushes:
        ticks = max(0, min(round(end / t.tick), count) - round(start / t.tick))
        up_ticks = ticks * (up * math.cos(angle) - forward * math.sin(angle))
        push, pushed = push + up_ticks, pushed + abs(up_ticks)
    off = float(momentum[1] - momentum[0]) / t.tick - (force + push - weight * count)
    return abs(off) / max(weight * max(count, 0.1 / t.tick), abs(force), pushed)
