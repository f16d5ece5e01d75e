"""Error against run time of a walk, setting by setting."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from biped.show.terminal import console, table


def show(result: Mapping[str, Any]) -> None:
    """Prints every setting with its errors and its cost, and the recommendations."""
    heads = ("setting", "CPU s/s", "error [rad]", "speed", "cost of transport", "lost [J/step]", "depth [mm]", "slip",
             "fell")  # fmt: skip
    rows = table(heads, ("setting",), no_wrap=True)
    for row in result["cases"]:
        rows.add_row(
            row["label"], f"{row['cpu_per_second']:.4f}", f"{row['error']:.1e}", _percent(row, "speed"),
            _percent(row, "cost_of_transport"), f"{row['loss_per_step']:.2f}", f"{1e3 * row['penetration']:.2f}",
            f"{row['slip']:.4f}", str(row["fell"]),
        )  # fmt: skip
    page = console()
    page.print(f"[bold]{result['scenario']}[/bold]: error after {result['horizon']:g} s against steps of 1/64 ms "
               "(median of starts); steady gait against 1/8 ms with 95 % half-width; MuJoCo's by RK4")  # fmt: skip
    page.print(rows)
    for best in result["recommended"]:
        label = best["label"] or "none of these"
        page.print(f"  {best['engine']}, cheapest within {best['level']:.1%}: [bold]{label}[/bold]")


def _percent(row: Mapping[str, Any], metric: str) -> str:
    return f"{100.0 * row[f'{metric}_shift']:+.2f} ± {100.0 * row[f'{metric}_shift_half_width']:.2f} %"
