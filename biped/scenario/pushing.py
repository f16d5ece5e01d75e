"""A push as pieces of constant force: what engines apply, and what metrics and pictures count."""

import math
from typing import NamedTuple

from msgspec.structs import replace

from biped.scenario.keys import Scenario
from biped.scenario.world import Push

PIECE = 0.01
"""[s] of a piece of a push whose force changes; of a sine, at most a 20th of its period."""
MOST_PIECES = 10_000
"""In a run."""


class Piece(NamedTuple):
    """Part of a push.

    Attributes:
        start: [s].
        end: [s].
        force: [N] as the push has it: forward and up, in space forward, to the left and up.
        body: What is pushed.
    """

    start: float
    end: float
    force: tuple[float, ...]
    body: str


def pieces(scenario: Scenario) -> tuple[Piece, ...]:
    """All pushes of a scenario; pieces begin and end with control ticks, and each has the mean of its push's force."""
    tick = 1.0 / scenario.simulation.control_rate
    seconds = scenario.duration
    train = (one for push in scenario.push for one in _train(push) if one.at < seconds)
    return tuple(piece for one in train for piece in _pieces(one, tick, seconds))


def _train(push: Push) -> tuple[Push, ...]:
    """A push as often as it comes."""
    if push.times == 1:
        return (push,)
    return tuple(replace(push, at=push.at + i * push.every, times=1) for i in range(push.times))


def count(push: Push, tick: float, duration: float) -> int:
    """How many pieces a push has in a run of a duration [s]."""
    if push.times > 1:
        return sum(count(one, tick, duration) for one in _train(push) if one.at < duration)
    if push.shape == "constant":
        return 1
    ticks = round(min(push.duration, max(0.0, duration - push.at)) / tick)
    return -(-ticks // _ticks(push, tick))


def _ticks(push: Push, tick: float) -> int:
    """Control ticks of a piece."""
    seconds = PIECE if push.shape == "ramp" else min(PIECE, 0.05 / push.frequency)
    return max(1, round(seconds / tick))


def _pieces(push: Push, tick: float, duration: float) -> list[Piece]:
    if push.shape == "constant":
        return [Piece(push.at, push.at + push.duration, push.force, push.body)]
    first, each, out = round(push.at / tick), _ticks(push, tick), []
    last = round(min(push.at + push.duration, duration) / tick)
    for k in range(first, last, each):
        start, end = k * tick, min(k + each, last) * tick
        share = _mean(push, start - first * tick, end - first * tick)
        out.append(Piece(start, end, tuple(share * one for one in push.force), push.body))
    return out


def _mean(push: Push, start: float, end: float) -> float:
    """Mean share of the largest force from one time [s] to another since a push began."""
    if push.shape == "ramp":
        return 0.5 * (start + end) / push.duration
    rate = 2.0 * math.pi * push.frequency
    return (math.cos(rate * start) - math.cos(rate * end)) / (rate * (end - start))
