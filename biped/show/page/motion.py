"""Charts of one run: speed against time, gait diagram, phase portraits, torques against their limits."""

import numpy as np

from biped.measure.pushes import pushes_of
from biped.measure.signals import SMOOTH, every, finite, inside, joint_limits, leg_states, smooth
from biped.measure.trajectory import Trajectory
from biped.robot.planar.topology import LEGS, SEGMENTS
from biped.show.page.html import Markup, card, scroll, tag
from biped.show.page.player import SIDES, spans, state_legend
from biped.show.page.plot import Frame, around, legend
from biped.show.words import leg_words, percent

Window = tuple[float, float]
_JOINTS = ("hip", "knee", "ankle")
_SHOWN = 3.0
"""[s] of the window that a gait diagram and torques show."""
_MEANS = f"means over {1e3 * SMOOTH:.0f} ms"


def charts(trajectory: Trajectory, window: Window) -> list[Markup]:
    """Groups of cards of a run.

    Args:
        trajectory: The run.
        window: [s] of steady walking; a run that ended before it is shown as a whole.
    """
    run = finite(trajectory)
    if len(run) < 3:
        return []
    rows = inside(run, window)
    wide = tag("div", _speed(run, rows), _gait(run, rows), class_="cards")
    return [wide, *(tag("div", *three, class_="cards three") for three in (_phase(run, rows), _torque(run, rows)))]


def _legs(run: Trajectory) -> Markup:
    return legend([(side, leg_words(leg)) for side, leg in zip(SIDES, run.robot.legs, strict=True)])


def _speed(run: Trajectory, rows: np.ndarray) -> Markup:
    at = every(run, 100.0)
    time, speed = run.time[at], smooth(run.forward_speed, run.tick)[at]
    frame = Frame((0.0 if time[0] < 1.0 else float(time[0]), float(time[-1])), around(speed), "time [s]",
                  "speed of the torso [m/s]", width=900.0, height=230.0)  # fmt: skip
    shown = pushes_of(run)
    for push in shown:
        frame.band((push.start, push.end), "pushed")
    mean, span = float(run.forward_speed[rows].mean()), run.time[rows][[0, -1]]
    frame.line(time, speed, "quiet")
    frame.line(span, [mean, mean], "accent dash")
    pushes = "; ".join(f"{push.size} on the {push.body} at {push.start:g} s" for push in shown)
    key = legend([("quiet", "speed"), ("accent", f"mean {mean:.2f} m/s in {span[0]:.3g} to {span[1]:.3g} s"),
                  *([("push", f"push: {pushes}")] if pushes else [])])  # fmt: skip
    return card("Speed", key, scroll(frame.svg("speed against time"), "speed against time"), wide=True)


def _begin(run: Trajectory, rows: np.ndarray) -> slice:
    """Rows of the first `_SHOWN` s of those that are chosen (n,)."""
    first = int(np.argmax(rows))
    last = min(int(len(rows) - np.argmax(rows[::-1])), first + round(_SHOWN / run.tick))
    return slice(first, max(last, first + 2))


def _gait(run: Trajectory, rows: np.ndarray) -> Markup:
    """Leg states as bars, double support behind them."""
    span = _begin(run, rows)
    time, state = run.time[span], leg_states(run)[span].astype(int)
    names = [leg_words(leg) for leg in run.robot.legs]
    frame = Frame((float(time[0]), float(time[-1]) + run.tick), (-0.7, 1.7), "time [s]", "",
                  rungs=names[::-1], width=900.0, height=170.0, left=60.0)  # fmt: skip
    both = np.asarray(run.down[span].all(axis=1))
    for start, end, on in spans(both):
        if on:
            frame.band((time[start], time[0] + end * run.tick), "both")
    for leg, side in enumerate(SIDES):
        for start, end, kind in spans(state[:, leg]):
            frame.rect((time[start], time[0] + end * run.tick), (0.68 - leg, 1.32 - leg), f"s{kind} {side}")
    whole = run.down[rows]
    shares = ", ".join(f"{name} {percent(float(whole[:, leg].mean()))}" for leg, name in enumerate(names))
    double, flight = float(whole.all(axis=1).mean()), float((~whole).all(axis=1).mean())
    note = f"On the ground in the window: {shares}; both legs {percent(double)}, neither {percent(flight)}."
    key = [state_legend(state), legend([("both", "both legs on the ground")])]
    return card("Gait diagram", *key, scroll(frame.svg("stance and swing of both legs"), "gait diagram"),
                note=note, wide=True)  # fmt: skip


def _phase(run: Trajectory, rows: np.ndarray) -> list[Markup]:
    cards, angles, rates = [], run.joint_angles, run.joint_rates
    for joint, name in enumerate(_JOINTS):
        curves = []
        for leg in range(LEGS):
            column = SEGMENTS * leg + joint
            angle = np.degrees(angles[rows, column])
            rate = np.degrees(smooth(rates[:, column], run.tick)[rows])
            curves.append((angle, rate))
        frame = Frame(around(np.concatenate([a for a, _ in curves])), around(np.concatenate([r for _, r in curves])),
                      f"{name} angle [°]", "rate [°/s]")  # fmt: skip
        for (angle, rate), side in reversed(list(zip(curves, SIDES, strict=True))):
            frame.line(angle, rate, f"{side} thin")
        cards.append(card(f"Phase portrait: {name}", _legs(run), frame.svg(f"phase portrait of the {name}"),
                          note=f"In the window; rates are {_MEANS}." if joint == 0 else None))  # fmt: skip
    return cards


def _torque(run: Trajectory, rows: np.ndarray) -> list[Markup]:
    span = _begin(run, rows)
    cards, limits, torques = [], joint_limits(run), run.joint_torques
    for joint, name in enumerate(_JOINTS):
        limit = float(max(limits[joint], limits[joint + SEGMENTS]))
        torque = [torques[:, SEGMENTS * leg + joint] for leg in range(LEGS)]
        means = [smooth(one, run.tick)[span] for one in torque]
        low, high = around(np.concatenate(means))
        bounded = not run.generalized and np.isfinite(limit)
        if bounded:
            low, high = min(low, -1.06 * limit), max(high, 1.06 * limit)
        time = run.time[span]
        frame = Frame((float(time[0]), float(time[-1])), (low, high), "time [s]", f"{name} torque [N m]")
        if bounded:
            frame.level(limit, "bad dash thin", f"limit {limit:g} N m")
            frame.level(-limit, "bad dash thin")
        for mean, side in reversed(list(zip(means, SIDES, strict=True))):
            frame.line(time, mean, f"{side} thin")
        peak = max(float(np.abs(one[rows]).max()) for one in torque)
        told = f"Largest of one tick in the window: {peak:.0f} N m"
        told += f" ({percent(peak / limit)} of the limit)." if bounded else "."
        if run.generalized:
            told += " Generalized forces: no motor's limit holds."
        cards.append(card(f"Torque: {name}", _legs(run), frame.svg(f"torques of the {name}"),
                          note=f"{told} Curves are {_MEANS}."))  # fmt: skip
    return cards
