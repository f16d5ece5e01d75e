"""`biped report`, `plot`, `video`, `view` and `export`: pages, figures, clips and files of results."""

import argparse
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

from biped.base.errors import safe
from biped.cli import common


def add_report(commands: common.Commands) -> None:
    """Adds the parser of `biped report`."""
    what = "write results as an HTML page, or campaigns as Markdown with figures"
    parser = common.command_parser(commands, "report", what, report_command)
    runs = (
        "results folders of run; with --html also of compare, diff, tune, stability and standard, and files of "
        "regress --json"
    )
    parser.add_argument("run", type=Path, nargs="+", help=runs)
    parser.add_argument("--html", type=Path, metavar="FILE", help="write one HTML page, which needs no network")
    parser.add_argument("--out", type=Path, help="the Markdown file (default: report.md, unless --html is given)")
    parser.add_argument("--title", default="Results", help="heading of the report (default: Results)")


def report_command(args: argparse.Namespace) -> int:
    """Writes the page, or both, and prints their names."""
    if args.html is not None:
        from biped.show.page import write_page

        write_page(args.run, args.html, args.title)
        print(args.html)
    if args.out is not None or args.html is None:
        from biped.show.replay import write_report

        out = args.out or Path("report.md")
        write_report(args.run, out, args.title)
        print(out)
    return common.DONE


def add_plot(commands: common.Commands) -> None:
    """Adds the parser of `biped plot`."""
    parser = common.command_parser(commands, "plot", "draw figures of a run or campaign", plot_command)
    parser.add_argument("run", type=Path, help="results folder")


def plot_command(args: argparse.Namespace) -> int:
    """Draws them and prints their names."""
    from biped.show.replay import plot_results

    for path in plot_results(args.run):
        print(path)
    return common.DONE


def add_video(commands: common.Commands) -> None:
    """Adds the parser of `biped video`."""
    parser = common.command_parser(
        commands, "video", "write a clip of a run, or of several beside each other", video_command
    )
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
    parser.add_argument("--only", type=common.whole, metavar="N", help="show run N of a campaign")
    parser.add_argument(
        "--width", type=common.whole, default=640, help="width in pixels (default: 640); the height follows"
    )
    parser.add_argument("--size", type=size, metavar="WxH", help="width and height in pixels, e.g. 1280x720")
    parser.add_argument("--fps", type=common.number, help="frames per second (default: 30, for a GIF 20)")
    parser.add_argument(
        "--from", dest="start", type=common.number, default=0.0, metavar="S", help="begin at this time [s]"
    )
    parser.add_argument(
        "--slow",
        type=common.number,
        default=1.0,
        metavar="TIMES",
        help="slow motion: this many times slower than real time",
    )
    parser.add_argument("--to", dest="end", type=common.number, metavar="S", help="end at this time [s]")


def size(text: str) -> tuple[int, int]:
    """The width and height [px] that an argument is."""
    try:
        width, height = (int(word) for word in text.lower().split("x"))
    except ValueError:
        raise argparse.ArgumentTypeError(f"expected a size in pixels such as 1280x720, got '{safe(text)}'") from None
    return width, height


def video_command(args: argparse.Namespace) -> int:
    """Draws and writes it."""
    from biped.show.film import Cut, film

    width, height = args.size or (args.width, None)
    cut = Cut(width, height, args.fps, args.start, args.end, args.slow, args.eye, args.ghost, args.apart)
    frames = film(args.run, args.out, cut, args.only)
    print(f"{args.out}: {frames} frames, {args.out.stat().st_size / 1e6:.2f} MB")
    return common.DONE


def add_view(commands: common.Commands) -> None:
    """Adds the parser of `biped view`."""
    parser = common.command_parser(commands, "view", "open a recording in the rerun viewer", view_command)
    parser.add_argument("run", nargs="?", type=Path, help="results folder or .rrd (default: the newest recording)")
    web = "open the viewer in a browser; this is the default without a display"
    parser.add_argument("--web", action="store_true", help=web)


def view_command(args: argparse.Namespace) -> int:
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
    return common.DONE


def add_export(commands: common.Commands) -> None:
    """Adds the parser of `biped export`."""
    parser = common.command_parser(commands, "export", "write results in formats of other programs", export_command)
    parser.add_argument("run", type=Path, help="results folder")
    wanted = parser.add_mutually_exclusive_group(required=True)
    files = "a new folder for EuroBench's files (docs/eurobench.md)"
    wanted.add_argument("--eurobench", type=Path, metavar="DIR", help=files)
    one = "an MCAP file of one run, for Foxglove and PlotJuggler (needs the package mcap)"
    wanted.add_argument("--mcap", type=Path, metavar="FILE", help=one)
    only = "with --mcap: number of the run (default: the only one, or the walker of median speed)"
    parser.add_argument("--only", type=int, metavar="RUN", help=only)


def export_command(args: argparse.Namespace) -> int:
    """Writes them and says how many."""
    if args.mcap is not None:
        from biped.show import mcap

        print(f"{mcap.export(args.run, args.mcap, args.only)} messages in {args.mcap}")
        return common.DONE
    from biped.show import eurobench

    files = eurobench.export(args.run, args.eurobench)
    print(f"{len(files)} files in {args.eurobench}/, format as in EuroBench's documents")
    return common.DONE
