"""A run that fell made likelier, as long as it falls in the same way: what is left is what it takes to fall.

The likelihood of a run is that of the normals that it draws, exp(−|z|²/2): the likeliest draws zeros. Parts of z are
set to zero, large ones first, then all of it shrinks, and what does not make the run fall any more is taken back:
delta debugging (A. Zeller, R. Hildebrandt, IEEE Trans. Softw. Eng. 28:183, 2002) on a run's random numbers. What it
finds is a local optimum.
"""

from __future__ import annotations

from collections.abc import Generator

from biped.scenario.normals import Move, Normals
from biped.studies.certify.outcome import RunOutcome
from biped.studies.certify.splitting import EARLIEST, Member

HALVINGS = 4
"""Of the run's duration: lengths of the parts that are set to zero."""
SHRINKS = (0.5, 0.7, 0.85, 0.95)
"""By which all of the normals are multiplied in turn."""


def plainer(first: Member, duration: float) -> Generator[list[Normals], list[RunOutcome], Member]:
    """Makes a run that fell likelier.

    Args:
        first: The run.
        duration: [s] of a run.

    Returns:
        The likeliest run on the way that fell as the first did, while the law that it is compared with stood.
    """
    best, outcome = first
    for move in _moves(outcome.end, duration):
        tried = best.moved(move)
        (met,) = yield [tried]
        if met.fell and met.stands and met.way == outcome.way and met.squares < outcome.squares:
            best, outcome = tried, met
    return best, outcome


def _moves(end: float, duration: float) -> list[Move]:
    none = Move(beta=0.0, keep=0.0, before=0.0)  # of what no time belongs to
    moves = [Move(beta=0.0, keep=0.0, after=max(end, EARLIEST)), none] if end < duration else [none]
    for halving in range(1, HALVINGS + 1):
        width = end / 2**halving
        moves += [
            Move(beta=0.0, keep=0.0, after=max(part * width, EARLIEST), before=(part + 1) * width)
            for part in range(2**halving)
        ]
    return [*moves, *(Move(beta=0.0, keep=share) for share in SHRINKS)]
