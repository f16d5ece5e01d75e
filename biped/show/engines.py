"""The table of docs/engines.md: `python -m biped.show.engines FOLDER [SCENARIO…]` makes its runs and writes it.

What an earlier call finished in the folder is not repeated; with `--finished` nothing else is run or listed. Scenarios
that are named come on top of those of `biped.studies.surveys`: of public policies, for instance, which nobody may
ship.
"""

import math
import sys
from collections.abc import Sequence
from pathlib import Path

from biped.base.errors import markdown_table
from biped.base.trust import trusting
from biped.scenario.engines import ENGINES
from biped.show.document import DOCS, replaced, share
from biped.studies.surveys import SCENARIOS, Cell, ScenarioCells, cells_of

PAGE = DOCS / "engines.md"


def table(rows: Sequence[ScenarioCells], engines: Sequence[str]) -> str:
    """The table in Markdown: of each scenario and engine how many reached the goal, its interval, and the speed."""
    heads = ("scenario", "goal", *(f"`{name}`" for name in engines))
    return markdown_table(
        heads, ((row.scenario, row.goal, *(_words(row.cells[name]) for name in engines)) for row in rows)
    )


def _words(cell: Cell | str | None) -> str:
    if cell is None:
        return "not run"
    if isinstance(cell, str):
        return "–"
    value, half = cell.speed
    error = f" ± {half:.3f}" if math.isfinite(half) else ""
    speed = f"; {value:.3f}{error} m/s" if math.isfinite(value) and abs(value) > 0.05 else ""
    return f"{share(cell.reached, cell.runs)}{speed}"


def main(folder: Path, more: Sequence[str], finished: bool = False) -> None:
    """Makes the runs and writes the table; says what became of runs that failed."""
    engines, rows = tuple(ENGINES), []
    with trusting(everything=True):
        for name in (*SCENARIOS, *more):
            rows.append(cells_of(name, engines, 1, folder, finished=finished))
            for engine, cell in rows[-1].cells.items():
                print(f"{name} {engine}: {cell if isinstance(cell, str) else _words(cell)}", flush=True)
                for failure in cell.failures if isinstance(cell, Cell) else ():
                    print(f"    {failure}", flush=True)
    rows = [row for row in rows if any(isinstance(cell, Cell) for cell in row.cells.values())]
    PAGE.write_text(replaced(PAGE.read_text(encoding="utf-8"), "table", table(rows, engines)), encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]), [name for name in sys.argv[2:] if name != "--finished"], "--finished" in sys.argv)
