"""The robot that was recognised in a model file, on a terminal."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rich.table import Table

from biped.base.files import label
from biped.base.text import plain
from biped.robot.report import ModelReport
from biped.robot.robot import Robot
from biped.show.terminal import console, table

if TYPE_CHECKING:
    from biped.studies.models import SurveyedModel

PARTS = 3
"""Of a path, so many from its end on tell models apart that are called scene.xml."""


HEAD = 13
"""Characters of the widest head, "right thigh", with its margin."""


def show_robot(found: ModelReport) -> None:
    """Prints what a robot is, or what is wrong with it and what to write."""
    out, robot = console(), found.robot
    by = "" if found.description is None else f", described by {plain(label(found.description))}"
    out.print(f"[bold]{plain(label(found.file))}[/bold]{by}")
    if robot is not None:
        _show(robot, found.parts)
    _rows([("[red]fault[/red]", fault) for fault in found.faults] + [("note", note) for note in found.notes])
    if robot is not None:
        _show_use(found, robot)


def show_models(rows: Sequence[SurveyedModel]) -> None:
    """Prints models in a row each, and how many are recognised and stand."""
    out, page = console(), table(("model", "mass", "actuators", "contact points", "stands"), ("model", "stands"))
    for row in rows:
        name = plain("/".join(Path(row.file).parts[-PARTS:]))
        if row.refused:
            page.add_row(name, "", "", "", f"refused: {plain(row.refused)}")
            continue
        stands = "" if row.stood is None else "yes" if row.stood else f"no: {plain(row.end)}"
        feet = " + ".join(str(count) for count in row.feet)
        page.add_row(name, f"{row.mass:.4g} kg", str(row.actuators), feet, stands)
    out.print(page)
    known = [row for row in rows if not row.refused]
    tried = [row for row in known if row.stood is not None]
    out.print(f"  {len(known)} of {len(rows)} recognised"
              + (f", {sum(bool(row.stood) for row in tried)} of {len(tried)} stand" if tried else ""))  # fmt: skip


def _show_use(found: ModelReport, robot: Robot) -> None:
    """Prints what a robot runs with, and a scenario to start from."""
    laws = [f"law = '{name}'" for name in found.laws] + ["a policy's card (law = 'card.toml')"]
    general = f"{', '.join(laws)}, or a law of your own (law = 'path.py:Class')"
    rows = [("laws", general)] if found.not_planar else [
        ("laws", "the law of the thesis, which needs no key, for this is a planar biped of seven links"),
        ("", f"with robot = {{}} in the scenario also {general}"),
    ]  # fmt: skip
    if found.not_spatial:
        reason = found.not_spatial.partition(f"model '{robot.name}': ")[2] or found.not_spatial
        rows.append(("", f"not law = 'spatial': {reason}"))
    if found.physics:
        rows.append(("physics", found.physics))
    _rows(rows)
    start = [f'law = "{found.laws[-1]}"']
    if not found.not_planar:
        start = ['controller = "normal"    # the gait of the human; biped list names others',
                 f'start.posture = "{plain(robot.start)}"']  # fmt: skip
    out = console()
    out.print("  Save this as first.toml, for example, and type: biped run first.toml --record")
    for line in (f'model = "{plain(label(found.file))}"', *start, "duration = 5.0",
                 *(('simulation.physics = "file"',) if found.physics else ())):  # fmt: skip
        out.print(f"    {line}", markup=False, highlight=False)


def _show(robot: Robot, parts: dict[str, str]) -> None:
    out = console()
    if robot.description:
        out.print(f"  {plain(robot.description)}")
    where = "in the plane (x, z, pitch)" if robot.planar else "in space (free joint)"
    rows = [("base", f"{robot.base}, moves {where}")]
    for foot in robot.feet:
        places = ", ".join(f"({', '.join(f'{x:.3g}' for x in place)})" for place in foot.points)
        count = f"{len(foot.points)} contact point{'s' if len(foot.points) > 1 else ''}"
        rows.append(("foot", f"{foot.name}, {count}, x, y, z [m] in its body's frame: {places}"))
    starts = ", ".join(robot.starts) or "none"
    rows += [
        ("mass", f"{robot.mass:.4g} kg"),
        ("leg", f"{robot.leg:.3g} m from the first hip joint to the sole"),
        *parts.items(),
        ("start", f"{robot.start or 'all coordinates at zero'}; keyframes of the file: {starts}"),
    ]
    _rows(rows)
    page = table(("actuator", "kind", "joint", "torque limit"), ("actuator", "kind", "joint"))
    for drive in robot.drives:
        limit = f"{drive.limit:g} N m" if drive.limited else "none"
        servo = f", {drive.stiffness:g} N m/rad" if drive.kind == "position" else ""
        page.add_row(plain(drive.name), drive.kind + servo, plain(drive.joint), limit)
    out.print(page)


def _rows(rows: Sequence[tuple[str, str]]) -> None:
    """Prints heads, each with words that wrap beside it."""
    page = Table.grid(padding=(0, 2, 0, 0))
    page.add_column(no_wrap=True, min_width=HEAD)
    page.add_column()
    for head, words in rows:
        page.add_row(f"  {head}", plain(words))
    if rows:
        console().print(page)
