"""`biped stability`: what a scenario's gait is as a limit cycle, and the walkers the method is validated on."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from biped.campaign import simulate
from biped.commands import RUNS, plan_of, title_of
from biped.errors import RunError
from biped.plan import Plan
from biped.results import dumps, new_folder
from biped.stability.fit import Fit, Returns, fit_map
from biped.stability.section import Section, crossings
from biped.vary import stream

SETTLING = 4
"""Strides that a walk is given to forget its start."""

STEADY = ("start.jitter=0.002", "randomise.runs=6", "duration=24.0", "window.start=8.0", "window.end=24.0")
"""The walks that steady states are taken from."""

KICKS = (0.005, 0.01)
"""Standard deviations of the kicks, in natural units."""

KICKED = 100
"""Kicked walks of each size, each followed for three returns."""

TWINS = (1e-9, 1e-7, 1e-5, 1e-3)
"""Sizes of disturbance at which single returns are compared."""

_PAIRS = 12


def _steady(plan: Plan) -> tuple[Section, np.ndarray, np.ndarray]:
    """The section, steady states (m, 17) and periods (m,) [s] of a plan's walks.

    Raises:
        RunError: The scenario does not walk long enough.
    """
    states, periods = [], []
    section, fell = None, 0
    for index in range(len(plan)):
        run = plan.run(index)
        t = simulate(run)
        section = section or Section(run, t.tree)
        found = crossings(t, section.height)
        if t.end != "completed":
            fell += 1
        else:
            states.append(section.states(found)[SETTLING:])
            periods.append(np.diff(found.time)[SETTLING:])
    if section is None or sum(map(len, periods)) < 5:
        raise RunError(
            f"no steady gait: {fell} of {len(plan)} walks of {plan.scenario.duration:g} s fell, and fewer than five "
            f"strides came after the first {SETTLING} of the others"
        )
    return section, np.vstack(states), np.concatenate(periods)


def _kicked(
    section: Section, steady: np.ndarray, size: float, seconds: float, rng: np.random.Generator
) -> tuple[Returns, int]:
    """Returns of kicked walks, from the first crossing after the kick, and how many of the walks fell."""
    before, after, walk = [], [], []
    fell = 0
    for i in range(KICKED):
        t, z = section.walk(section.kicked(steady[rng.integers(len(steady))], size, rng), seconds)
        fell += t.end != "completed"
        before.append(z[:-1])
        after.append(z[1:])
        walk.append(np.full(max(len(z) - 1, 0), i))
    returns = Returns(np.vstack(before), np.vstack(after), np.concatenate(walk))
    if len(returns.walk) < 4 * steady.shape[1]:
        raise RunError(f"kicks of {size:g} leave {len(returns.walk)} returns, {fell} of {KICKED} walks fell: no fit")
    return returns, fell


def _twins(section: Section, steady: np.ndarray, seconds: float, rng: np.random.Generator) -> list[float]:
    """Median distance after a return over distance before it, for each size of `TWINS`."""
    ratios: list[list[float]] = [[] for _ in TWINS]
    for z in steady[rng.permutation(len(steady))[:_PAIRS]]:
        direction = rng.standard_normal(z.size)
        direction[0] = abs(direction[0])  # up: no foot is pressed into the ground
        _, base = section.walk(z, seconds)
        for size, out in zip(TWINS, ratios, strict=True):
            _, other = section.walk(z + size * direction / np.linalg.norm(direction), seconds)
            if len(base) and len(other):
                out.append(float(np.linalg.norm(other[0] - base[0])) / size)
    return [float(np.median(out)) if out else float("nan") for out in ratios]


def _row(label: str, size: float, fit: Fit, fell: int) -> dict[str, Any]:
    return {
        "steps": label,
        "kick": size,
        "fell": fell,
        "walks": KICKED,
        "radius": fit.radius,
        "interval": list(fit.interval),
        "explained": fit.explained,
        "multipliers": [[float(m.real), float(m.imag)] for m in fit.multipliers],
        "stable": fit.interval[1] < 1.0,
    }


def study(name: str, changes: Sequence[str]) -> tuple[dict[str, Any], list[tuple[Returns, Fit]]]:
    """Measures a gait at the scenario's step and tick and at half of both.

    Args:
        name: Name or path of a scenario.
        changes: `--set` changes.

    Returns:
        The result object, and for each of its rows the returns and their fit.

    Raises:
        InputError: The scenario cannot be used.
        RunError: It has no steady gait to speak of.
    """
    simulation = plan_of(name, changes).scenario.simulation
    finer = [
        f"simulation.timestep={0.5 * simulation.timestep}", f"simulation.control_rate={2.0 * simulation.control_rate}"
    ]  # fmt: skip
    rows, drawn, gait = [], [], []
    height = 0.0
    for label, more in (("scenario's", []), ("halved", finer)):
        plan = plan_of(name, [*changes, *STEADY, *more])
        try:
            section, steady, period = _steady(plan)
            height = section.height
            rng = stream(plan.scenario.seed, "stability")
            seconds = float(period.mean())
            gait.append({
                "steps": label,
                "strides": len(period),
                "period": seconds,
                "period_std": float(period.std()),
                "spread": float(np.sqrt(steady.var(axis=0).sum())),
                "twins": _twins(section, steady, 1.3 * seconds, rng),
            })  # fmt: skip
            for size in KICKS:
                returns, fell = _kicked(section, steady, size, 4.3 * seconds, rng)
                fit = fit_map(returns, rng)
                drawn.append((returns, fit))
                rows.append(_row(label, size, fit, fell))
        except RunError as error:
            # A gait may walk at one step and fall at another: that is a result, unless there is nothing else to tell.
            if not rows:
                raise
            gait.append({"steps": label, "failed": str(error)})
    result = {
        "scenario": title_of(name),
        "section": f"right heel {1e3 * height:g} mm above the ground, coming down",
        "gait": gait,
        "twin_sizes": list(TWINS),
        "fits": rows,
        "stable": all(row["stable"] for row in rows) and not any("failed" in g for g in gait),
    }
    return result, drawn


def run(name: str, changes: Sequence[str], out: Path | None, json: bool) -> bool:
    """Studies a scenario, writes stability.json and stability.png, prints; returns whether the gait is stable."""
    title = title_of(name)
    result, drawn = study(name, changes)
    from biped.figures.stability import plot_stability

    folder = out if out is not None else new_folder(RUNS, f"{title.replace('/', '-')}-stability")
    plot_stability(result, drawn, folder)
    (folder / "stability.json").write_text(dumps(result, indent=1), encoding="utf-8")
    if json:
        print(dumps(result))
    else:
        _show(result)
        print(f"  results in {folder}/")
    return result["stable"]


def _show(result: dict[str, Any]) -> None:
    from biped.terminal import console

    out = console()
    out.print(f"[bold]{result['scenario']}[/bold]: section: {result['section']}")
    for gait in result["gait"]:
        if "failed" in gait:
            out.print(f"  {gait['steps']} steps: {gait['failed']}")
            continue
        twins = ", ".join(f"{size:g}: {ratio:.2g}" for size, ratio in zip(TWINS, gait["twins"], strict=True))
        out.print(f"  {gait['steps']} steps: {gait['strides']} strides of {gait['period']:.4f} ± "
                  f"{gait['period_std']:.4f} s, states spread by {gait['spread']:.2g}; "
                  f"a disturbance after one return, by size: {twins}")  # fmt: skip
    for row in result["fits"]:
        low, high = row["interval"]
        largest = ", ".join(f"{complex(*m):.3f}" for m in row["multipliers"][:3])
        out.print(f"  {row['steps']} steps, kicks of {row['kick']:g}: largest multiplier {row['radius']:.2f} "
                  f"({low:.2f} – {high:.2f}), explains {row['explained']:.0%}; {largest}; "
                  f"{row['fell']} of {row['walks']} fell")  # fmt: skip
