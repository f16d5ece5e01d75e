"""The player of a walk, and charts of what happened inside it."""

import json
import math
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from biped.measure.pushes import pushes_of
from biped.measure.signals import SMOOTH, every, finite, inside, joint_limits, leg_states, smooth
from biped.measure.trajectory import Trajectory
from biped.robot.planar.topology import LEGS, SEGMENTS
from biped.show.document import STATES, leg_words, percent
from biped.show.page.frames import NAMES, RATE, Frames
from biped.show.page.html import Frame, Markup, around, card, join, legend, scroll, tag

SIDES = ("right", "left")
"""Classes of the legs, whatever people call them: the first is blue, the second orange, everywhere."""
VIEWS = {"three quarters": (35.0, 12.0), "side": (0.0, 0.0), "front": (90.0, 6.0)}
"""Azimuth and elevation [degrees] of the cameras: azimuth 0 is the robot's right, 90 is ahead of it."""
_SHAPE = 1.75
"""Width of the stage over its height."""
_FLASH = 0.2
"""[s] between the figures of the stroboscope."""


class PlayedRun(NamedTuple):
    """A run that is shown.

    Attributes:
        name: On its tab.
        said: What became of it, in a sentence.
        frames: Its pictures.
        ghosts: Names and pictures of others that are seen as shadows beside it.
    """

    name: str
    said: str
    frames: Frames
    ghosts: tuple[tuple[str, Frames], ...] = ()


def walks(shown: Sequence[PlayedRun]) -> Markup:
    """Panels of runs, one of which is seen at a time."""
    tabs = None
    if len(shown) > 1:
        tabs = tag("div", *(tag("button", run.name, type="button", role="tab", aria_selected="false") for run in shown),
                   class_="tabs", role="tablist")  # fmt: skip
    return tag("div", tabs, *(_panel(run) for run in shown), class_="walks")


def _panel(run: PlayedRun) -> Markup:
    frames = run.frames
    legs = [leg_words(leg) for leg in frames.legs]
    controls = tag(
        "div",
        tag("button", "▶", type="button", aria_label="Play", data_part="play"),
        tag("input", type="range", min=0, max=len(frames.time) - 1, value=0, step=1, aria_label="Time",
            data_part="scrub"),
        tag("output", "", data_part="time"),
        tag("select", *(tag("option", word, value=value) for word, value in (("1×", 1), ("½×", 0.5), ("⅕×", 0.2))),
            aria_label="Speed", data_part="speed"),
        class_="controls",
    )  # fmt: skip
    views = tag(
        "div",
        *(tag("button", name, type="button", aria_pressed="false", data_view=f"{azimuth:g},{elevation:g}")
          for name, (azimuth, elevation) in VIEWS.items()),
        class_="views", role="group", aria_label="Camera",
    ) if frames.space else None  # fmt: skip
    key = legend([(SIDES[0], legs[0]), (SIDES[1], legs[1]), ("force", "ground force"),
                  *([("push", "push")] if frames.pushes else []),
                  *((f"ghost{i}", f"ghost: {name}") for i, (name, _) in enumerate(run.ghosts))])  # fmt: skip
    data = frames.data() | {"ghosts": [ghost.shadow() for _, ghost in run.ghosts]}
    return tag(
        "div", tag("p", run.said, class_="about"), key, views, _stage(frames, len(run.ghosts)), _strobe(frames),
        _lanes(frames, legs), controls, tag("p", "", class_="readout", data_part="readout"), class_="walk",
        data_walk=json.dumps(data, separators=(",", ":")), data_legs="|".join(legs),
    )  # fmt: skip


def _stage(frames: Frames, ghosts: int) -> Markup:
    """The drawing that the script moves; metres, down positive."""
    leg = frames.leg
    along = frames.place[:, 11, 0]
    arms = [tag("polyline", class_="limb arm", data_part=f"arm{i}") for i in range(len(frames.arms))]
    left = [arm for arm, line in zip(arms, frames.arms, strict=True) if frames.place[0, line[-1], 1] > 0.0]
    parts = [
        tag("g", _ground(frames, along.min() - 3.0 * leg, along.max() + 3.0 * leg), data_part="ground"),
        tag("path", class_="floor", data_part="floor"),
        tag("path", class_="trail", data_part="trail"),
        *(
            tag("polyline", class_=f"limb ghost ghost{i}", data_part=f"ghost{i}{part}")
            for i in range(ghosts)
            for part in ("first", "second", "trunk")
        ),
        *left,
        tag("polyline", class_="limb left", data_part="second"),
        tag("polyline", class_="limb trunk", data_part="trunk"),
        tag("circle", class_="head", r=round(0.1 * leg, 4), data_part="head"),
        tag("polyline", class_="limb right", data_part="first"),
        *(arm for arm in arms if arm not in left),
        tag("circle", class_="centre", r=0.022, data_part="centre"),
        *(tag("path", class_="arrow", data_part=f"force{i}") for i in range(4)),
        tag("path", class_="arrow push", data_part="push"),
        tag("text", "", class_="said", data_part="said"),
    ]
    high, low = max(1.95 * leg, frames.height + 0.4 * leg), 0.35 * leg
    wide = (high + low) * _SHAPE
    box = f"{-0.5 * wide:.3f} {-high:.3f} {wide:.3f} {high + low:.3f}"
    return tag("svg", tag("g", *parts, data_part="world"), viewBox=box, class_="stage", role="img",
               aria_label="stick figure of the walk")  # fmt: skip


def _ground(frames: Frames, low: float, high: float) -> Markup:
    """The ground as it slopes and steps, with a mark every half metre and a number at every metre."""
    x, z = frames.ground.T
    inside = (x > low) & (x < high)
    at = np.concatenate([[low], x[inside], [high]])
    line = "L".join(f"{x:.3f} {-z:.3f}" for x, z in zip(at, np.interp(at, x, z), strict=True))
    marks = [tag("path", d=f"M{line}v3H{low:.3f}Z", class_="soil"), tag("path", d=f"M{line}", class_="ruler")]
    for half in range(math.ceil(2 * low), math.floor(2 * high) + 1):
        place = 0.5 * half
        depth = -float(np.interp(place, x, z))
        marks.append(tag("path", d=f"M{place} {depth:.3f}v{0.07 if half % 2 == 0 else 0.035}", class_="ruler"))
        if half % 2 == 0:
            words = f"{half // 2} m".replace("-", "−")
            marks.append(tag("text", words, x=place, y=round(depth + 0.16, 3), text_anchor="middle"))
    if len(frames.seat):
        corners = " ".join(f"{x:.3f},{-z:.3f}" for x, z in frames.seat)
        marks.append(tag("polygon", points=corners, class_="seat"))
    return tag("g", *marks)


def _strobe(frames: Frames) -> Markup:
    """Figures at equal times side by side: what is seen on paper, and without a script."""
    place = frames.place[:: max(1, round(_FLASH * RATE)), :, ::2] * [1.0, -1.0]
    low, high = place[..., 0].min() - 0.15, place[..., 0].max() + 0.15
    top, bottom = place[..., 1].min() - 0.25 * frames.leg, max(place[..., 1].max(), 0.0) + 0.22
    figures = []
    for picture in place:
        limbs = []
        for side in (1, 0):
            hip, knee, ankle, toe, heel = picture[side * len(NAMES) : (side + 1) * len(NAMES)]
            limbs.append(_limb([hip, knee, ankle, heel, toe, ankle], SIDES[side]))
        figures.append(tag("g", _limb([picture[0], picture[10]], "trunk"), *limbs))
    box = f"{low:.3f} {top:.3f} {high - low:.3f} {bottom - top:.3f}"
    return tag("svg", _ground(frames, low, high), *figures, viewBox=box, class_="strobe", role="img",
               aria_label=f"a figure every {_FLASH} s")  # fmt: skip


def _limb(points: Sequence[np.ndarray], class_: str) -> Markup:
    return tag("polyline", points=" ".join(f"{x:.3f},{y:.3f}" for x, y in points), class_=f"limb {class_}")


def _lanes(frames: Frames, legs: Sequence[str]) -> Markup:
    """Leg states against time, a row a leg."""
    n = len(frames.time)
    rows = []
    for leg, side in enumerate(SIDES):
        state = frames.state[:, leg]
        bars = [
            tag("rect", tag("title", STATES.get(kind, "")), x=round(1000 * first / n, 2), y=0,
                width=round(1000 * (last - first) / n, 2), height=18, class_=f"s{kind} {side}")
            for first, last, kind in spans(state)
        ]  # fmt: skip
        cursor = tag("line", x1=0, x2=0, y1=0, y2=18, class_="cursor")
        rows += [tag("span", legs[leg]), tag("svg", *bars, cursor, viewBox="0 0 1000 18",
                 preserveAspectRatio="none", role="img", aria_label=f"states of the {legs[leg]}")]  # fmt: skip
    return join([tag("div", *rows, class_="lanes"), state_legend(frames.state)])


def spans(values: np.ndarray) -> list[tuple[int, int, int]]:
    """First row, row behind the last, and value, of each stretch over which values (n,) stay the same."""
    cuts = [0, *(np.flatnonzero(np.diff(values)) + 1).tolist(), len(values)]
    return [(a, b, int(values[a])) for a, b in pairwise(cuts)]


def state_legend(states: np.ndarray) -> Markup:
    """Shades of a leg's colour and what they stand for, of the states that occur."""
    there = set(np.unique(states).tolist())
    entries = [
        tag("span", *(tag("i", class_=f"key s{state} {side}") for side in SIDES), words)
        for state, words in STATES.items()
        if state in there
    ]
    return tag("p", *entries, class_="legend")


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
