"""The robot that was recognised in a model file, on a terminal."""

from __future__ import annotations

from biped.base.files import label
from biped.base.text import plain
from biped.robot.robot import Robot
from biped.show.terminal import console, table
from biped.studies.robot import ModelReport


def show_robot(found: ModelReport) -> None:
    """Prints what a robot is, or what is wrong with it and what to write."""
    out = console()
    by = "" if found.description is None else f", described by {plain(label(found.description))}"
    out.print(f"[bold]{plain(label(found.file))}[/bold]{by}")
    if found.robot is not None:
        _show(found.robot)
    for fault in found.faults:
        out.print(f"  [red]fault[/red]  {plain(fault)}", markup=True)
    if found.planar and found.robot is not None:
        laws = " or ".join(f"law = '{name}'" for name in found.laws)
        out.print(f"  runs with a law of one's own (law = 'path.py:Class'), {laws}; not with the thesis's:")
        out.print(f"    {plain(found.planar)}")
    elif found.robot is not None:
        out.print(
            "  a planar biped of seven links: the thesis's law walks it; as any robot, with [robot] in a scenario"
        )


def _show(robot: Robot) -> None:
    out = console()
    where = "in the plane (x, z, pitch)" if robot.planar else "in space (free joint)"
    if robot.description:
        out.print(f"  {plain(robot.description)}")
    out.print(f"  base       {plain(robot.base)}, moves {where}")
    for foot in robot.feet:
        places = "; ".join(" ".join(f"{x:.3g}" for x in place) for place in foot.points)
        out.print(f"  foot       {plain(foot.name)}, {len(foot.points)} contact points [m]: {places}")
    out.print(f"  mass, leg  {robot.mass:.4g} kg, {robot.leg:.3g} m from hip to sole")
    starts = ", ".join(plain(name) for name in robot.starts) or "none: coordinates at zero"
    out.print(f"  start      {plain(robot.start) or '-'} (keyframes: {starts})")
    page = table(("actuator", "kind", "joint", "torque limit"), ("actuator", "kind", "joint"))
    for drive in robot.drives:
        limit = f"{drive.limit:g} N m" if drive.limited else "none"
        servo = f", {drive.stiffness:g} N m/rad" if drive.kind == "position" else ""
        page.add_row(plain(drive.name), drive.kind + servo, plain(drive.joint), limit)
    out.print(page)
