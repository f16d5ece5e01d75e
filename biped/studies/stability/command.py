"""`biped stability`: studies a scenario's gait, writes figures and numbers, prints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from biped.base.json import dumps
from biped.base.writing import write_text
from biped.ensemble.folder import complaining, new_folder
from biped.studies.run import RUNS, title_of
from biped.studies.stability.basin import FELL, RETURNED, WALKS
from biped.studies.stability.sizes import RETURNS
from biped.studies.stability.study import ENGINES, place, study


def run(
    name: str, changes: Sequence[str], engine: str | None, jobs: int, slices: bool, out: Path | None, json: bool
) -> bool:
    """Studies a scenario; returns whether kicks die out on average in every place it was measured.

    Args:
        name: Name or path of a scenario.
        changes: `--set` changes.
        engine: The only engine; default: both.
        jobs: Number of processes.
        slices: Whether to cut the basin of attraction too.
        out: Folder of stability.json and figures; default: a new one below `RUNS`.
        json: Whether to print the result object and nothing else.
    """
    title = title_of(name)
    result, drawn = study(name, changes, ENGINES if engine is None else (engine,), jobs, slices)
    from biped.show.figures.basin import plot_basin
    from biped.show.figures.stability import plot_stability

    folder = out if out is not None else new_folder(RUNS, f"{title}-stability")
    plot_stability(result, drawn, folder)
    if slices:
        plot_basin(result, folder)
    with complaining(folder / "stability.json"):
        write_text(folder / "stability.json", dumps(result, indent=1))
    if json:
        print(dumps(result))
    else:
        show(result)
        print(f"  results in {folder}/")
    return result["stable"]


def show(result: Mapping[str, Any]) -> None:
    """Prints what a gait is, place by place."""
    from biped.show.terminal import console

    out = console()
    out.print(f"[bold]{result['scenario']}[/bold]")
    for gait in result["gaits"]:
        if "failed" in gait:
            out.print(f"  {place(gait)}: {gait['failed']}")
            continue
        out.print(f"  {place(gait)}: [bold]{gait['kind']}[/bold]; section: {gait['section']}")
        for line in _lines(gait):
            out.print(f"    {line}", soft_wrap=True)


def _lines(gait: Mapping[str, Any]) -> list[str]:
    lines = [
        f"{gait['strides']} strides of {gait['period']:.4f} ± {gait['period_std']:.4f} s, states spread by "
        f"{gait['spread']:.2g}; {gait['fell']} of {gait['walks']} walks fell"
    ]
    small = gait["exponent"]
    if small is not None:
        least = "at least " if small["bound"] else ""
        lines.append(
            f"Lyapunov exponent {least}{small['value']:.3f} ± {small['half_width']:.3f} per return; "
            f"{small['lost']} chains fell"
        )
    orbit = gait["orbit"]
    if orbit is not None and orbit["multipliers"] is not None:
        sizes = ", ".join(f"{abs(complex(*m)):.4f}" for m in orbit["multipliers"][:4])
        lines.append(
            f"fixed to {orbit['residual']:.0e}; |Floquet multipliers| of {orbit['returns']} return(s) {sizes}, each "
            f"off by at most {max(orbit['error']):.0e}"
        )
    after = ", ".join(f"{row['size']:g}: {row['after'][-1]:.2g}" for row in gait["sizes"])
    lines.append(f"distance {RETURNS} returns after a kick, by size: {after}")
    lines.append(_floor_words(gait["floor"]))
    fit = gait["fit"]
    low, high = fit["interval"]
    lines.append(
        f"kicks of {fit['kick']:g}, linear fit: largest multiplier {fit['radius']:.2f} ({low:.2f} – {high:.2f}), "
        f"explains {fit['explained']:.0%}; {fit['fell']} of {fit['walks']} fell"
    )
    if "basin" in gait:
        counts = {name: sum(map(sum, gait["basin"][name])) for name in (RETURNED, WALKS, FELL)}
        total = sum(counts.values())
        lines.append("basin slice: " + ", ".join(f"{name} {count} of {total}" for name, count in counts.items()))
    return lines


def _floor_words(floor: float | None) -> str:
    if floor is None:
        return "no size of kick has shrunk"
    return "kicks of every size have shrunk" if floor == 0.0 else f"kicks above {floor:.2g} have shrunk"
