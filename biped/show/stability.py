"""A gait as a limit cycle, beside the walkers whose cycles are known."""

from collections.abc import Mapping

import numpy as np

from biped.show.document import Block, Document, Heading, Items, Paragraph, Table, Words
from biped.studies.stability import MeasuredGait, Studied
from biped.studies.stability.basin import FELL, RETURNED, RETURNS, WALKS, Basin
from biped.studies.stability.growth import PAIRS, STRIDES, Grown
from biped.studies.stability.reference import Known
from biped.studies.stability.sensitivity import STEPS, GaitSensitivity


def document_of(studied: Studied) -> Document:
    """A gait, place by place."""
    blocks: list[Block] = [Heading(studied.scenario)]
    for gait in studied.gaits:
        if gait.measured is None:
            blocks.append(Paragraph(f"{gait.place}: {gait.failed}"))
            continue
        kind = Words(gait.measured.kind, "strong")
        blocks.append(Paragraph((f"{gait.place}: ", kind, f"; section: {gait.measured.section}")))
        blocks.append(Items(tuple(_lines(gait.measured))))
    return tuple(blocks)


def _lines(gait: MeasuredGait) -> list[str]:
    lines = [
        f"{gait.strides} strides of {gait.period:.4f} ± {gait.period_std:.4f} s, states spread by "
        f"{gait.spread:.2g}; {gait.fell} of {gait.walks} walks fell"
    ]
    small = gait.exponent
    if small is not None:
        least = "at least " if small.bound else ""
        lines.append(
            f"Lyapunov exponent {least}{small.value:.3f} ± {small.half_width:.3f} per return; {small.lost} chains fell"
        )
    if gait.orbit is not None and gait.orbit.cycle is not None:
        cycle = gait.orbit.cycle
        sizes = ", ".join(f"{abs(m):.4f}" for m in cycle.multipliers[:4])
        lines.append(
            f"fixed to {cycle.residual:.0e}; |Floquet multipliers| of {gait.orbit.returns} return(s) {sizes}, each "
            f"off by at most {max(cycle.error):.0e}"
        )
    after = ", ".join(f"{row.size:g}: {row.after[-1]:.2g}" for row in gait.sizes)
    lines.append(f"distance {RETURNS} returns after a kick, by size: {after}")
    lines.append(_floor_words(gait.floor))
    fit = gait.kicked.fit
    low, high = fit.interval
    lines.append(
        f"kicks of {gait.kicked.kick:g}, linear fit: largest multiplier {fit.radius:.2f} ({low:.2f} – {high:.2f}), "
        f"explains {fit.explained:.0%}; {gait.kicked.fell} of {gait.kicked.walks} fell"
    )
    if gait.basin is not None:
        lines.append(_basin_words(gait.basin))
    return lines


def _floor_words(floor: float | None) -> str:
    if floor is None:
        return "no size of kick has shrunk"
    return "kicks of every size have shrunk" if floor == 0.0 else f"kicks above {floor:.2g} have shrunk"


def _basin_words(basin: Basin) -> str:
    counts = {name: sum(map(sum, basin.counts[name])) for name in (RETURNED, WALKS, FELL)}
    total = sum(counts.values())
    return "basin slice: " + ", ".join(f"{name} {count} of {total}" for name, count in counts.items())


def known_document(cycles: Mapping[str, Known]) -> Document:
    """The reference cycles beside what is known of them."""
    blocks: list[Block] = []
    for name, (cycle, state, known, alike) in cycles.items():
        off = f"{_text(cycle.multipliers)}, each off by at most {cycle.error.max():.0e}"
        rows = (("state", _text(cycle.state)), ("known", _text(state)), ("multipliers", off), ("known", _text(known)),
                ("found as those were", _text(alike)))  # fmt: skip
        blocks += [Heading(name), Table(("", ""), rows, (0, 1))]
    return tuple(blocks)


def _text(values: np.ndarray) -> str:
    return ", ".join(
        f"{value:.10f}" if np.isreal(value) else f"{complex(value):.10f}" for value in np.real_if_close(values)
    )


def growth_document(grown: Grown) -> Document:
    """How pushes of one tick grow, as a document."""
    heads = ("push [m √(g l)]", "growth a stride", "95 % interval", "apart at the first strike", "at the last", "fell")
    rows = tuple(
        (f"{one.size:g}", f"{one.factor:.2f}", f"{one.low:.2f} … {one.high:.2f}", f"{one.distances[0]:.1e}",
         f"{one.distances[-1]:.1e}", f"{one.fell} of {one.pairs}")
        for one in grown.sizes
    )  # fmt: skip
    note = (
        f"{PAIRS} pushes of each size at other moments of a stride, the state compared with that of the same walk "
        f"without a push at {STRIDES} strikes of the first foot, in natural units. Below 1 pushes die out. Strikes are "
        "known to a tick, and a policy's network computes in 32 bits: of what moves by less than either, growth says "
        "no more than how fast it reaches that floor."
    )
    title = f"{grown.scenario} in {grown.engine}: growth of small pushes"
    return Heading(title, 1), Table(heads, rows, ()), Paragraph(note, note=True)


def sensitivity_document(found: GaitSensitivity) -> Document:
    """The gait sensitivity norm, as a document."""
    heads = ("disturbance", "size", "norm", "95 % interval", "of step times", "of steps' ways", "fell")
    rows = tuple(
        (one.disturbance, f"{one.size:g} {'l' if one.disturbance.startswith('step') else 'm √(g l)'}",
         f"{one.norm:.2f}", f"{one.low:.2f} … {one.high:.2f}", *(f"{part:.2f}" for part in one.parts),
         f"{one.fell} of {one.walks}")
        for one in found.kinds
    )  # fmt: skip
    note = (
        f"The root of the summed squares by which the {STEPS} steps after a disturbance differ from the usual ones, "
        "over its size, in natural units: the smaller, the less a walk is upset. What steps scatter without a "
        "disturbance is taken off. Walks that fell do not count."
    )
    title = f"{found.scenario} in {found.engine}: gait sensitivity norm"
    return Heading(title, 1), Table(heads, rows, ()), Paragraph(note, note=True)
