"""The robot that was recognised in a model file, on a terminal."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from biped.base.files import label
from biped.base.text import plain
from biped.robot.report import ModelReport
from biped.robot.robot import Robot
from biped.show.terminal import console, table

if TYPE_CHECKING:
    from biped.studies.models import SurveyedModel

PARTS = 3
"""Of a path, so many from its end on tell models apart that are called scene.xml."""


def show_robot(found: ModelReport) -> None:
    """Prints what a robot is, or what is wrong with it and what to write."""
    out, robot = console(), found.robot
    by = "" if found.description is None else f", described by {plain(label(found.description))}"
    out.print(f"[bold]{plain(label(found.file))}[/bold]{by}")
    if robot is not None:
        _show(robot, found.parts)
    for fault in found.faults:
        out.print(f"  [red]fault[/red]  {plain(fault)}", markup=True)
    for note in found.notes:
        out.print(f"  note       {plain(note)}", markup=True)
    if robot is not None:
        _show_use(found)


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


def _show_use(found: ModelReport) -> None:
    """Prints what a robot runs with, and a scenario to start from."""
    out = console()
    if found.not_spatial:
        out.print(f"  not with   {plain(found.not_spatial)}")
    if found.physics:
        out.print(f"  physics    {plain(found.physics)}")
    laws = " or ".join(f"law = '{name}'" for name in found.laws)
    own = "a policy's card ('card.toml') or a law of one's own ('path.py:Class')"
    if not found.not_planar:
        out.print("  runs with  the thesis's law walks it as a planar biped of seven links; as any robot with [robot], "
                  f"{laws}, {own}")  # fmt: skip
        return
    out.print(f"  runs with  {laws}, {own}")
    out.print("  a scenario to start from, such as first.toml; then: biped run first.toml --record")
    for line in (f'model = "{plain(label(found.file))}"', f'law = "{found.laws[-1]}"', "duration = 5.0",
                 *(('simulation.physics = "file"',) if found.physics else ())):  # fmt: skip
        out.print(f"    {line}", markup=False, highlight=False)


def _show(robot: Robot, parts: dict[str, str]) -> None:
    out = console()
    where = "in the plane (x, z, pitch)" if robot.planar else "in space (free joint)"
    if robot.description:
        out.print(f"  {plain(robot.description)}")
    out.print(f"  base       {plain(robot.base)}, moves {where}")
    for foot in robot.feet:
        places = "; ".join(" ".join(f"{x:.3g}" for x in place) for place in foot.points)
        out.print(f"  foot       {plain(foot.name)}, {len(foot.points)} contact points [m]: {places}")
    out.print(f"  mass, leg  {robot.mass:.4g} kg, {robot.leg:.3g} m from hip to sole")
    for what, words in parts.items():
        out.print(f"  {what:<11} {plain(words)}")
    starts = ", ".join(plain(name) for name in robot.starts) or "none: coordinates at zero"
    out.print(f"  start      {plain(robot.start) or '-'} (keyframes: {starts})")
    page = table(("actuator", "kind", "joint", "torque limit"), ("actuator", "kind", "joint"))
    for drive in robot.drives:
        limit = f"{drive.limit:g} N m" if drive.limited else "none"
        servo = f", {drive.stiffness:g} N m/rad" if drive.kind == "position" else ""
        page.add_row(plain(drive.name), drive.kind + servo, plain(drive.joint), limit)
    out.print(page)
