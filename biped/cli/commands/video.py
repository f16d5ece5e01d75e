"""`biped video`: a clip of runs."""

import argparse
from pathlib import Path

from biped.base.text import safe
from biped.cli.common import DONE
from biped.cli.parser import Commands, command_parser, number, whole


def add(commands: Commands) -> None:
    """Adds the parser of `biped video`."""
    parser = command_parser(commands, "video", "write a clip of a run, or of several beside each other", command)
    eye = (
        "where the camera is: three-quarters (default), side, front, back, left, or azimuth,elevation in degrees. "
        "At azimuth 0 it is at the robot's right, at 90 ahead. Write --eye=-30,10 if the first number is negative"
    )
    parser.add_argument(
        "run",
        type=Path,
        nargs="+",
        help="results folders, up to six; of a campaign the walker of median speed is shown",
    )
    parser.add_argument("--out", type=Path, default=Path("walk.mp4"), help="*.mp4 or *.gif (default: walk.mp4)")
    parser.add_argument("--ghost", action="store_true", help="draw the second run as a shadow over the first")
    parser.add_argument(
        "--apart",
        action="store_true",
        help="draw each run in a picture of its own; with more than two runs this is always so",
    )
    parser.add_argument("--eye", default="three-quarters", metavar="FROM", help=eye)
    parser.add_argument("--only", type=whole, metavar="N", help="show run N of a campaign")
    parser.add_argument("--width", type=whole, default=640, help="width in pixels (default: 640); the height follows")
    parser.add_argument("--size", type=size, metavar="WxH", help="width and height in pixels, e.g. 1280x720")
    parser.add_argument("--fps", type=number, help="frames per second (default: 30, for a GIF 20)")
    parser.add_argument("--from", dest="start", type=number, default=0.0, metavar="S", help="begin at this time [s]")
    parser.add_argument(
        "--slow", type=number, default=1.0, metavar="TIMES", help="slow motion: this many times slower than real time"
    )
    parser.add_argument("--to", dest="end", type=number, metavar="S", help="end at this time [s]")


def size(text: str) -> tuple[int, int]:
    """The width and height [px] that an argument is."""
    try:
        width, height = (int(word) for word in text.lower().split("x"))
    except ValueError:
        raise argparse.ArgumentTypeError(f"expected a size in pixels such as 1280x720, got '{safe(text)}'") from None
    return width, height


def command(args: argparse.Namespace) -> int:
    """Draws and writes it."""
    from biped.show.film import Cut, film

    width, height = args.size or (args.width, None)
    cut = Cut(width, height, args.fps, args.start, args.end, args.slow, args.eye, args.ghost, args.apart)
    frames = film(args.run, args.out, cut, args.only)
    print(f"{args.out}: {frames} frames, {args.out.stat().st_size / 1e6:.2f} MB")
    return DONE
