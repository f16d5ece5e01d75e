"""`biped view`: a recording in the rerun viewer."""

from __future__ import annotations

import argparse
import subprocess
import sys

from biped.show.replay import recording_of


def command(args: argparse.Namespace) -> int:
    """Opens the viewer and waits for it."""
    path = recording_of(args.run)
    print(f"opening {path}")
    return subprocess.call([sys.executable, "-m", "rerun", str(path)])
