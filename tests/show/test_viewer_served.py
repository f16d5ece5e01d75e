"""The viewer in a browser: chosen without a display, served on this machine alone, its tunnel told."""

from __future__ import annotations

import os
import re
import signal
import socket
import subprocess
import sys
import time
import urllib.request
from pathlib import Path

import pytest

from biped.cli.main import main
from biped.show import viewer


@pytest.fixture
def called(monkeypatch, tmp_path):
    commands = []
    monkeypatch.setattr(subprocess, "call", lambda argv, **more: commands.append(argv) or 0)
    monkeypatch.chdir(tmp_path)
    Path("walk.rrd").write_bytes(b"")
    return commands


@pytest.mark.parametrize(("argv", "display", "served"), [([], True, False), ([], False, True), (["--web"], True, True)])
def test_a_browser_is_chosen_where_there_is_no_display(called, argv, display, served, monkeypatch, capsys):
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    monkeypatch.setenv("DISPLAY", ":0" if display else "")
    assert main(["view", "walk.rrd", *argv]) == 0
    (command,) = called
    out = capsys.readouterr().out
    assert ("--serve-web" in command) == served
    assert ("no display here" in out) == (served and not display)
    if served:
        assert command[command.index("--bind") + 1] == "127.0.0.1"
        pages, data = (command[command.index(f"--{name}") + 1] for name in ("web-viewer-port", "port"))
        assert f"http://localhost:{pages}/?url=rerun%2Bhttp%3A%2F%2Flocalhost%3A{data}%2Fproxy" in out
        assert f"ssh -N -L {pages}:localhost:{pages} -L {data}:localhost:{data} " in out


def test_other_ports_where_those_are_taken():
    with socket.socket() as door:
        door.bind((viewer.HERE, 0))
        door.listen()
        taken = door.getsockname()[1]
        assert viewer._free(taken) not in (taken, 0)


@pytest.mark.slow
def test_the_viewer_is_there(tmp_path):
    assert main(["run", "level_normal", "--set", "duration=0.3", "--set", "window.start=0.1", "--set",
                 "window.end=0.3", "--record", "--out", str(tmp_path / "one")]) in (0, 1)  # fmt: skip
    found = viewer.served(tmp_path / "one" / "recording.rrd")
    # The package's command starts the server as another process, which outlives it: both are a group of their own.
    process = subprocess.Popen(found.command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                               start_new_session=True)  # fmt: skip
    try:
        page, began = re.sub(r"\?.*", "", found.url), time.monotonic()
        while True:
            try:
                with urllib.request.urlopen(page, timeout=5) as answer:
                    assert "rerun" in answer.read().decode().lower()
                break
            except OSError:
                assert time.monotonic() - began < 60.0
                time.sleep(0.2)
    finally:
        os.killpg(process.pid, signal.SIGTERM)
        process.wait()
