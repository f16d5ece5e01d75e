"""The robot that was recognised in a model file, as a document."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from biped.base.files import label
from biped.robot.report import ModelReport
from biped.robot.robot import Robot
from biped.show.document import Block, Document, Heading, Items, Line, Paragraph, Table, Words

if TYPE_CHECKING:
    from biped.studies.models import SurveyedModel

PARTS = 3
"""Of a path, so many from its end on tell models apart that are called scene.xml."""


def document_of(found: ModelReport) -> Document:
    """A robot as it is read, or the fault in it and the lines to write."""
    robot = found.robot
    by = "" if found.description is None else f", described by {label(found.description)}"
    blocks: list[Block] = [Heading((label(found.file), by))]
    if robot is not None:
        blocks += _parts(robot, found.parts)
    blocks += _rows(
        [(Words("fault", "bad"), fault) for fault in found.faults] + [("note", note) for note in found.notes]
    )
    if robot is not None:
        blocks += _use(found, robot)
    return tuple(blocks)


def models_document(rows: Sequence[SurveyedModel]) -> Document:
    """Models in a row each, and how many are recognised and stand."""
    lines = []
    for row in rows:
        name = "/".join(Path(row.file).parts[-PARTS:])
        if row.refused:
            lines.append((name, "", "", "", f"refused: {row.refused}"))
            continue
        stands = "" if row.stood is None else "yes" if row.stood else f"no: {row.end}"
        feet = " + ".join(str(count) for count in row.feet)
        lines.append((name, f"{row.mass:.4g} kg", str(row.actuators), feet, stands))
    known = [row for row in rows if not row.refused]
    tried = [row for row in known if row.stood is not None]
    words = f"{len(known)} of {len(rows)} recognised"
    words += f", {sum(bool(row.stood) for row in tried)} of {len(tried)} stand" if tried else ""
    heads = ("model", "mass", "actuators", "contact points", "stands")
    return Table(heads, tuple(lines), (0, 4)), Paragraph(words)


def _use(found: ModelReport, robot: Robot) -> list[Block]:
    """The settings a robot runs with, and a scenario to start from."""
    laws = [f"law = '{name}'" for name in found.laws] + ["a policy's card (law = 'card.toml')"]
    general = f"{', '.join(laws)}, or a law of your own (law = 'path.py:Class')"
    rows: list[tuple[Line, str]] = [("laws", general)] if found.not_planar else [
        ("laws", "the law of the thesis, which needs no key, for this is a planar biped of seven links"),
        ("", f"with robot = {{}} in the scenario also {general}"),
    ]  # fmt: skip
    if found.not_spatial:
        reason = found.not_spatial.partition(f"model '{robot.name}': ")[2] or found.not_spatial
        rows.append(("", f"not law = 'spatial': {reason}"))
    if found.physics:
        rows.append(("physics", found.physics))
    start = [f'law = "{found.laws[-1]}"']
    if not found.not_planar:
        start = ['controller = "normal"    # the gait of the human; biped list names others',
                 f'start.posture = "{robot.start}"']  # fmt: skip
    lines = (f'model = "{label(found.file)}"', *start, "duration = 5.0",
             *(('simulation.physics = "file"',) if found.physics else ()))  # fmt: skip
    advice = "Save this as first.toml, for example, and type: biped run first.toml --record"
    return [*_rows(rows), Paragraph(advice), Items(tuple(Words(line, "code") for line in lines))]


def _parts(robot: Robot, parts: dict[str, str]) -> list[Block]:
    where = "in the plane (x, z, pitch)" if robot.planar else "in space (free joint)"
    rows: list[tuple[Line, str]] = [("base", f"{robot.base}, moves {where}")]
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
    drives = []
    for drive in robot.drives:
        limit = f"{drive.limit:g} N m" if drive.limited else "none"
        servo = f", {drive.stiffness:g} N m/rad" if drive.kind == "position" else ""
        drives.append((drive.name, drive.kind + servo, drive.joint, limit))
    said: list[Block] = [Paragraph(robot.description)] if robot.description else []
    return [*said, *_rows(rows), Table(("actuator", "kind", "joint", "torque limit"), tuple(drives), (0, 1, 2))]


def _rows(rows: Sequence[tuple[Line, str]]) -> list[Block]:
    """Heads, each with words that wrap beside it."""
    return [Table(("", ""), tuple(rows), (0, 1))] if rows else []
