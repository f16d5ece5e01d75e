"""The bench experiments of chapter IV as tables."""

from __future__ import annotations

import math

from biped.show.terminal import console, table
from biped.studies.bench.robot import Report

JOINTS = ("hip", "knee", "ankle")


def show(report: Report) -> None:
    """Prints periods and damping of the free swings, and the responses of the experiment with moving references."""
    page = console()
    page.print("[bold]Free swing[/bold] (Fig 4.7): small swings of the hip with a straight leg, of the knee with the "
               "thigh held level")  # fmt: skip
    rows = table(("joint", "gears hip/knee", "period [s]", "damping ratio", "MuJoCo apart [degrees]"),
                 ("joint", "gears hip/knee"))  # fmt: skip
    for swing in report.swings:
        apart = "–" if math.isnan(swing.apart) else f"{swing.apart:.1e}"
        rows.add_row(swing.joint, swing.reading.name, f"{swing.period:.4f}", f"{swing.damping_ratio:.4f}", apart)
    page.print(rows)
    page.print("[bold]Springs with moving references[/bold] (Fig 4.8): amplitude and lag [degrees] at the reference's "
               "frequency")  # fmt: skip
    rows = table(("joint", "in 10.7 – 14.7 s", "steady", "a linearisation says"), ("joint",))
    followed = report.followed
    for joint, *found in zip(JOINTS, followed.window, followed.steady, followed.linear, strict=True):
        rows.add_row(joint, *(f"{one.amplitude:.2f}, {one.lag:.1f}" for one in found))
    page.print(rows)
    page.print(f"  MuJoCo apart by at most {followed.apart:.1e} degrees")
