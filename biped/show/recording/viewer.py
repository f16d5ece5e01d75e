"""A recording in the rerun viewer: below a notebook's cell, in a window of its own, or in a browser."""

import subprocess
import sys
from pathlib import Path

import rerun as rr
import rerun.notebook

from biped.show.web import has_display, quiet, served


def open_viewer(path: Path) -> None:
    """Shows a recording and does not wait.

    Args:
        path: The .rrd file; a server in a browser's place ends with this process.
    """
    if _in_notebook() and rerun.notebook.HAS_NOTEBOOK:
        recording = rr.RecordingStream("biped")
        recording.log_file_from_path(path)
        rr.notebook_show(recording=recording)
        return
    if has_display():
        subprocess.Popen([sys.executable, "-m", "rerun", str(path)], start_new_session=True)
        return
    found = served(path)
    print(f"no display here: open {found.url}\nfrom afar, first: {found.tunnel}")
    _serving.append(ends_with_this_process(found.command))


def ends_with_this_process(command: list[str]) -> subprocess.Popen[bytes]:
    """Starts a command that ends when this process does, however it ends: whoever watches it reads a pipe from here."""
    return subprocess.Popen(
        [sys.executable, "-c", _WATCH, *command], stdin=subprocess.PIPE, start_new_session=True, env=quiet()
    )


_serving: list[subprocess.Popen[bytes]] = []
"""Watchers of servers: their pipes stay open as long as this process lives."""
_WATCH = """
import os, signal, subprocess, sys
served = subprocess.Popen(sys.argv[1:], stdin=subprocess.DEVNULL, start_new_session=True)
sys.stdin.buffer.read()
if hasattr(os, "killpg"):
    try:
        os.killpg(served.pid, signal.SIGTERM)
    except ProcessLookupError:
        pass
else:
    served.terminate()
served.wait()
"""
"""Ends a command and all that it started: rerun's own command starts the server as another process."""


def _in_notebook() -> bool:
    """Whether a notebook's kernel runs this process; a terminal's IPython is none."""
    shell = sys.modules["IPython"].get_ipython() if "IPython" in sys.modules else None
    return getattr(shell, "kernel", None) is not None
