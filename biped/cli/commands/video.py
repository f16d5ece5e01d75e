"""`biped video`: a clip of one run, or of two."""

from __future__ import annotations

import argparse
from pathlib import Path

from biped.cli.common import DONE
from biped.cli.parser import Commands, command_parser, number, whole


def add(commands: Commands) -> None:
    """Adds the parser of `biped video`."""
    parser = command_parser(commands, "video", "write a clip of one run, or of two beside each other", command)
    parser.add_argument("run", type=Path, nargs="+", help="one or two results folders; of a campaign the median walker")
    parser.add_argument("--out", type=Path, default=Path("walk.mp4"), help="*.mp4 or *.gif (default: walk.mp4)")
    parser.add_argument("--ghost", action="store_true", help="draw the second run as a shadow over the first")
    parser.add_argument("--only", type=whole, metavar="N", help="run N of a campaign")
    parser.add_argument("--width", type=whole, default=640, help="pixels (default: 640)")
    parser.add_argument("--fps", type=number, help="frames a second (default: 30; of a GIF 20)")
    parser.add_argument("--from", dest="start", type=number, default=0.0, metavar="S", help="begin at this time [s]")
    parser.add_argument("--to", dest="end", type=number, metavar="S", help="end at this time [s]")


def command(args: argparse.Namespace) -> int:
    """Draws and writes it."""
    from biped.show.film import Cut, film

    cut = Cut(args.width, args.fps, args.start, args.end)
    frames = film(args.run, args.out, cut, args.ghost, args.only)
    print(f"{args.out}: {frames} frames, {args.out.stat().st_size / 1e6:.2f} MB")
    return DONE
