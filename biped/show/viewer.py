"""A recording in the rerun viewer: below a notebook's cell, in a window of its own, or in a browser.

In a browser it is served on this machine alone, with a word on how to reach it from another.
"""

import getpass
import os
import socket
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple
from urllib.parse import quote

PAGES, DATA = 9090, 9876
"""Ports of the viewer and of its data, if they are free."""
HERE = "127.0.0.1"
"""The only address that is listened to: a recording is nobody else's business."""


class Served(NamedTuple):
    """A recording that is served.

    Attributes:
        command: What serves it.
        url: What to open in a browser.
        tunnel: What to type on another machine first.
    """

    command: list[str]
    url: str
    tunnel: str


def served(recording: Path) -> Served:
    """How to serve a recording, on ports that are free now."""
    pages = _free(PAGES)
    data = _free(DATA)
    command = [
        sys.executable, "-m", "rerun", "--serve-web", "--bind", HERE, "--port", str(data), "--web-viewer-port",
        str(pages), str(recording),
    ]  # fmt: skip
    url = f"http://localhost:{pages}/?url={quote(f'rerun+http://localhost:{data}/proxy', safe='')}"
    ports = f"-L {pages}:localhost:{pages} -L {data}:localhost:{data}"
    return Served(command, url, f"ssh -N {ports} {_user()}@{socket.gethostname()}")


def has_display() -> bool:
    """Whether a window can be opened: elsewhere than on Linux there is a screen unless somebody came by ssh."""
    if sys.platform == "linux":
        return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
    return "SSH_CONNECTION" not in os.environ


def quiet() -> dict[str, str]:
    """The environment in which the viewer's server says only what is wrong."""
    return {"RUST_LOG": "warn", **os.environ}


def _free(port: int) -> int:
    """The port if it is free, or another one."""
    for wanted in (port, 0):
        with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as door:
            door.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                door.bind((HERE, wanted))
            except OSError:
                continue
            return int(door.getsockname()[1])
    return port


def _user() -> str:
    try:
        return getpass.getuser()
    except (OSError, KeyError):  # an account without a name
        return "you"


def open_viewer(path: Path) -> None:
    """Shows a recording and does not wait.

    Args:
        path: The .rrd file; a server in a browser's place ends with this process.
    """
    if _in_notebook():
        import rerun
        import rerun.notebook

        if rerun.notebook.HAS_NOTEBOOK:
            recording = rerun.RecordingStream("biped")
            recording.log_file_from_path(path)
            rerun.notebook_show(recording=recording)
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
