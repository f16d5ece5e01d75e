"""A report of results folders in Markdown, with figures in files beside it."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from biped.base.errors import InputError
from biped.base.replacing import Kind, may_add, may_write
from biped.base.writing import write_text
from biped.ensemble.guard import numbered
from biped.ensemble.plan import Plan
from biped.scenario.keys import Scenario
from biped.scenario.laws import own_law
from biped.scenario.reading import read_scenario
from biped.scenario.vary import points_of
from biped.show.document import Block, Heading, Line, Picture, Words
from biped.show.markdown import text
from biped.show.replay import plot_results
from biped.show.results import document_of
from biped.show.words import harmless
from biped.studies.folders import results_at, writing

MARK = "<!-- written by biped report -->"
KIND = Kind("a report of biped", (".md", ".markdown"), (MARK.encode(),))


def write_report(folders: Sequence[Path], out: Path, title: str) -> None:
    """Writes a report of results folders, its figures in a folder beside it.

    Args:
        folders: Results folders.
        out: The Markdown file; figures go to a folder of the same name without suffix.
        title: First heading.

    Raises:
        InputError: A folder holds no results, the report cannot be written, or something else is there.
    """
    may_write(out, "--out", KIND)
    blocks: list[Block] = [Heading(title, 1)]
    taken: set[Path] = set()
    for folder in folders:
        result = harmless(results_at(folder))
        scenario = read_scenario(str(folder / "scenario.toml"), looking=True)
        beside = next(path for path in numbered(out.with_suffix(""), folder.resolve().name) if path not in taken)
        taken.add(beside)
        may_add(beside, "--out")
        figures = plot_results(folder, beside)
        drawn = [figure.relative_to(out.parent) for figure in figures]
        blocks += document_of(
            result, scenario.description, _setting(result, scenario, _command(folder, result, scenario))
        )
        blocks += [Picture(figure.stem, figure) for figure in drawn]
    with writing(f"--out {out}"):
        write_text(out, f"{text(tuple(blocks))}\n{MARK}\n")


def _command(folder: Path, result: Mapping[str, Any], scenario: Scenario) -> str:
    """The command that repeats a folder's runs: by the scenario's name only if that alone gives the same."""
    try:
        plan = Plan(read_scenario(result["scenario"], looking=True), checked=True)
        name = result["scenario"] if plan.scenario == Plan(scenario, checked=True).scenario else ""
    except InputError:
        name = ""
    runs = result["runs"]
    several = scenario.randomise.runs * len(points_of(scenario)) > 1
    only = f" --only {runs[0]['index']}" if several and len(runs) == 1 else ""
    trust = " --trust" if own_law(scenario.law) else ""
    return f"biped run {name or folder / 'scenario.toml'}{only}{trust}"


def _setting(result: Mapping[str, Any], scenario: Scenario, command: str) -> Line:
    """How runs were made, in a line."""
    start = scenario.start
    starts = "projected onto the ground" if start.settle else "as printed"
    return (Words(command, "code"), f": {len(result['runs'])} × {scenario.duration:g} s, jitter {start.jitter:g} rad, "
            f"contacts {scenario.actuation.contacts}, starts {starts}")  # fmt: skip
