"""Files of runs that fell in a campaign: their last seconds, and how to see each again."""

import re
import shlex
from collections.abc import Callable
from pathlib import Path

from biped.base.files import label
from biped.base.writing import write_text, written
from biped.ensemble import packed
from biped.ensemble.guard import complaining

FAILURES = "failures"
"""Where, in a results folder."""

_KEPT = re.compile(r"run-\d{5,}\.(xz|txt)|\.run-\d{5,}\.(xz|txt)\.part")
_HALF = re.compile(r"\.run-\d{5,}\.(xz|txt)\.part")


def keep(
    folder: Path, number: int, cause: str, save: Callable[[Path], None], more: str = "", traceback: str = ""
) -> None:
    """Keeps a trajectory of run `number` of a results folder, wherever it was made, and how to see it again.

    Args:
        folder: The results folder.
        number: Of the run.
        cause: How it ended.
        save: Writes the trajectory to a file.
        more: Arguments that the command needs besides.
        traceback: Of a law of the user's own that raised.

    Raises:
        RunError: It cannot be written.
    """
    kept = folder / FAILURES
    again = f"biped run {shlex.quote(label(folder / 'scenario.toml'))} --only {number}{more}"
    with complaining(kept):
        kept.mkdir(exist_ok=True)
        with written(kept / f"run-{number:05d}{packed.SUFFIX}") as part:
            save(part)
        write_text(kept / f"run-{number:05d}.txt", f"{cause}\nagain: {again}\n{traceback}")


def files_of(folder: Path, half: bool = False) -> list[Path]:
    """Files that `keep` left in a results folder, or only those that it was writing when it was ended."""
    if not (folder / FAILURES).is_dir():
        return []
    return [path for path in (folder / FAILURES).iterdir() if (_HALF if half else _KEPT).fullmatch(path.name)]
