"""Recordings for the rerun viewer.

Rerun is imported here, and for a notebook by `biped.show.viewer`: a run that is not recorded does not pay for it.
"""

import hashlib
from collections.abc import Sequence
from pathlib import Path

import rerun as rr

from biped.base.errors import InputError
from biped.base.replacing import Kind, may_write
from biped.measure.signals import every
from biped.show.recording.layout import layout, log_report
from biped.show.recording.scene import PICTURES, log_body, log_scene
from biped.show.recording.series import Placed, Recorded, log_series, log_states, place

__all__ = ["Recorded", "record"]


KIND = Kind("a recording", (), (b"RRF2",))


def record(path: Path, runs: Sequence[Recorded], *, title: str) -> None:
    """Writes one recording of one or several runs, side by side or, ghosts, over the run before them.

    The same runs give the same content.

    Args:
        path: The .rrd file.
        runs: What to record; names differ.
        title: What the viewer calls the recording.

    Raises:
        InputError: The file cannot be written, something else is there, or a run is finite at no time.
    """
    may_write(path, "recording", KIND)
    placed = place(runs)
    try:
        path.open("wb").close()  # rerun would say so only after taking data for it
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {error.strerror}") from None
    # The viewer keeps one layout per application, and a layout names entities: other names, another one.
    names = "\n".join(run.root for run in placed)
    application = "biped-" + hashlib.sha256(names.encode()).hexdigest()[:8]
    with rr.RecordingStream(application, recording_id=_identity(placed, title), send_properties=False) as recording:
        recording.save(path, default_blueprint=layout(placed))
        recording.send_recording_name(title)
        recording.log("/", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        for run in placed:
            rows = every(run.run.trajectory, PICTURES)
            log_body(recording, run, rows)
            log_scene(recording, run, rows)
            log_series(recording, run)
            log_states(recording, run)
            log_report(recording, run)


def _identity(runs: list[Placed], title: str) -> str:
    """A recording id that follows from what is recorded."""
    digest = hashlib.sha256(title.encode())
    for placed in runs:
        digest.update(f"{placed.root}\n{placed.run.ghost}\n{placed.run.scenario_text}\n".encode())
        digest.update(placed.run.trajectory.log.tobytes())
    return digest.hexdigest()[:32]
