"""A recording's server ends with the process that showed it, however that ends."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SHOWS = """
import sys, time
from biped.show.viewer import ends_with_this_process
server = "import os, time; print(os.getpid(), flush=True); time.sleep(600)"
command = "import subprocess, sys; subprocess.call(sys.argv[1:])"     # as rerun's: it starts the server and waits
kept = ends_with_this_process([sys.executable, "-c", command, sys.executable, "-c", server])
time.sleep(600)
"""


def alive(process: int) -> bool:
    """Whether a process lives; one that ended and that nobody has waited for does not."""
    try:
        return ") Z " not in Path(f"/proc/{process}/stat").read_text(encoding="ascii")
    except OSError:
        return False


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="processes are looked up in /proc")
@pytest.mark.parametrize("how", [signal.SIGTERM, signal.SIGKILL])
def test_a_server_ends_with_the_process_that_showed_it(how):
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    with subprocess.Popen([sys.executable, "-c", SHOWS], env=environment, stdout=subprocess.PIPE, text=True) as parent:
        server = int(parent.stdout.readline())
        assert alive(server)
        parent.send_signal(how)
        parent.communicate()  # until all who could write to its pipe are gone: the server too
    deadline = time.monotonic() + 60
    while alive(server) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not alive(server)
