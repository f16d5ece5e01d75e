"""`biped view`: a recording in the rerun viewer."""

import argparse
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

from biped.cli.common import DONE
from biped.cli.parser import Commands, command_parser


def add(commands: Commands) -> None:
    """Adds the parser of `biped view`."""
    parser = command_parser(commands, "view", "open a recording in the rerun viewer", command)
    parser.add_argument("run", nargs="?", type=Path, help="results folder or .rrd (default: the newest recording)")
    web = "open the viewer in a browser; this is the default without a display"
    parser.add_argument("--web", action="store_true", help=web)


def command(args: argparse.Namespace) -> int:
    """Opens the viewer, in a browser where that is asked for or there is no display, and waits for it."""
    from biped.show.replay import recording_of
    from biped.show.viewer import has_display, quiet, served

    path = recording_of(args.run)
    if not args.web and has_display():
        print(f"opening {path}")
        return subprocess.call([sys.executable, "-m", "rerun", str(path)])
    if not args.web:
        print("no display here: the viewer is served to a browser, as with --web")
    found = served(path)
    print(f"serving {path} until Ctrl-C\n  open        {found.url}\n  from afar   {found.tunnel}", flush=True)
    with suppress(KeyboardInterrupt):
        return subprocess.call(found.command, env=quiet())
    return DONE
