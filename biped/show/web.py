"""rerun's viewer in a browser: served on this machine alone, and how to reach it from another."""

import getpass
import os
import socket
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
