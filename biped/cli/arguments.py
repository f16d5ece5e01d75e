"""What may stand on the command line, and what is said of anything else."""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

from biped.base import VERSION
from biped.base.errors import InputError
from biped.base.text import said


class Parser(argparse.ArgumentParser):
    """Complains like everything else here: by an `InputError`."""

    def error(self, message: str) -> NoReturn:
        """See `argparse.ArgumentParser.error`."""
        from biped.base.files import nearest

        unknown = re.match(r"argument COMMAND: invalid choice: '(.*?)'", message)
        if unknown:
            known = list(_commands(self))
            raise InputError(
                f"command '{said(unknown[1])}': expected one of {', '.join(known)}; {nearest(unknown[1], known)}"
            )
        raise InputError(f"{message.removeprefix('argument ')}; see: {self.prog} --help")


def _whole(text: str) -> int:
    try:
        return int(text) if len(text) < 20 else int("too many digits")
    except ValueError:
        raise argparse.ArgumentTypeError(f"expected a whole number, got '{said(text)}'") from None


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"expected a number, got '{said(text)}'") from None


def _commands(parser: argparse.ArgumentParser) -> dict[str, argparse.ArgumentParser]:
    """The parsers of the commands; argparse has them in its own list of sub-parsers."""
    (commands,) = (action for action in parser._actions if isinstance(action, argparse._SubParsersAction))
    return commands.choices


def _parser() -> Parser:
    parser = Parser(
        prog="biped",
        description="Does this walking controller really work? Runs walking scenarios, measures and checks them.",
        epilog="Exit code 0: done, all expectations met; 1: a run or a check failed; 2: bad input; "
        "3: too few runs to decide a check. "
        "With --debug anywhere, errors come with a traceback.",
    )
    parser.add_argument("--version", action="version", version=f"biped {VERSION}")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)

    def scenarios(name: str, what: str) -> argparse.ArgumentParser:
        command = commands.add_parser(name, help=what, description=what)
        command.add_argument("scenario", nargs="+", help="name in scenarios/, or path of a scenario file")
        command.add_argument("--set", dest="changes", metavar="KEY=VALUE", action="append", default=[],
                             help="change a key, e.g. ground.slope=2 (VALUE is TOML; repeatable)")  # fmt: skip
        command.add_argument("--engine", help="engine to run in")
        _trust(command)
        _who(command)
        command.add_argument("--json", action="store_true", help="print one JSON object and nothing else")
        return command

    run = scenarios("run", "run scenarios; write metrics, trajectory and, if wanted, a recording")
    run.add_argument("--out", type=Path, help="results folder (default: a new one below runs/)")
    run.add_argument("--record", action="store_true", help="also write a recording for the rerun viewer")
    run.add_argument(
        "--live",
        action="store_true",
        help="watch one run in MuJoCo's viewer in real time, push with the mouse; nothing is written",
    )
    run.add_argument("--only", type=_whole, metavar="N", help="replay run N of the ensemble alone")
    run.add_argument("--shard", metavar="I/N", help="make share I of N of a campaign, in the --out that all share")
    _same(run)
    check = scenarios("check", "run scenarios and compare with their [expect]")
    _same(check)
    check.add_argument("--junit", type=Path, metavar="FILE", help="also write JUnit XML")
    regress = commands.add_parser("regress", help="compare scenarios with their recorded reference numbers",
                                  description="Runs a fixed part of scenarios and compares with recorded numbers: "
                                  "digit by digit where they were recorded, elsewhere the physics.")  # fmt: skip
    regress.add_argument("scenario", nargs="*", help="name in scenarios/, or path (default: every shipped scenario)")
    regress.add_argument("--update", action="store_true", help="record what differs as the new reference")
    regress.add_argument("--reason", help="why results changed; kept in the file (needed by --update)")
    regress.add_argument("--file", type=Path, help="file of references (default: that of the shipped scenarios)")
    _trust(regress)
    _who(regress)
    regress.add_argument("--json", action="store_true", help="print one JSON object and nothing else")
    compare = scenarios("compare", "run scenarios in both engines: every metric side by side, with its gap")
    compare.add_argument("--out", type=Path, help="folder for figures and recordings (default: new ones below runs/)")
    diff = commands.add_parser(
        "diff", help="what changed between two results, gaits or laws, run by run",
        description="Compares two results folders, or runs a scenario with each of two gaits or laws and compares: "
        "every metric's change with its interval, paired by seed. Exit code 1: something became worse.",
    )  # fmt: skip
    diff.add_argument("first", help="what is compared with: results folder, gait (name or path) or law (path.py:Class)")
    diff.add_argument("second", help="what is judged: the same kind of thing")
    diff.add_argument("--scenario", help="of gaits and laws: what to run, name in scenarios/ or path")
    diff.add_argument("--set", dest="changes", metavar="KEY=VALUE", action="append", default=[],
                      help="of gaits and laws: change a key (repeatable)")  # fmt: skip
    diff.add_argument("--metrics", metavar="NAME,…", default="", help="compare and judge these alone (default: all)")
    diff.add_argument("--margin", type=float, default=0.05,
                      help="a change within this share is none that matters (default: 0.05)")  # fmt: skip
    diff.add_argument("--out", type=Path, help="folder for diff.json and diff.md (default of gaits: one below runs/)")
    diff.add_argument("--html", type=Path, metavar="FILE", help="also one HTML page, as report --html writes them")
    _trust(diff)
    _who(diff)
    diff.add_argument("--json", action="store_true", help="print one JSON object and nothing else")
    tune = commands.add_parser("tune", help="find gains that serve a scenario's conditions",
                               description="Finds gains that serve the conditions in a scenario's [tune].")  # fmt: skip
    tune.add_argument("scenario", help="name in scenarios/, or path of a scenario file with a [tune] table")
    tune.add_argument("--set", dest="changes", metavar="KEY=VALUE", action="append", default=[],
                      help="change a key (repeatable)")  # fmt: skip
    _trust(tune)
    _who(tune)
    tune.add_argument("--out", type=Path, help="results folder; an interrupted search in it is continued")
    tune.add_argument("--least", metavar="GAIT", help="no search: put a found gait's gains back one by one, those that "
                      "are missed least first; how many does it take?")  # fmt: skip
    tune.add_argument("--json", action="store_true", help="print one JSON object and nothing else")
    standard = commands.add_parser(
        "standard", help="what gaits stand: slopes, pushes, uneven ground, each searched to failure",
        description="Puts gaits to the tests in scenarios/standard: each searched to the largest value that holds, by "
        "ensembles, with intervals; one table. An interrupted table in --out is gone on with.",
    )  # fmt: skip
    standard.add_argument("gait", nargs="+", help="name in controllers/, or path of a gait file")
    standard.add_argument("--test", metavar="NAME", action="append", default=[],
                          help="this test alone, name in scenarios/standard or path of a scenario with [standard] "
                          "(repeatable; default: all)")  # fmt: skip
    standard.add_argument("--set", dest="changes", metavar="KEY=VALUE", action="append", default=[],
                          help="change a key of all tests, e.g. model=robot (repeatable)")  # fmt: skip
    standard.add_argument("--engine", help="engine to run in")
    standard.add_argument("--out", type=Path, help="folder for standard.json and standard.md (default: below runs/)")
    _who(standard)
    standard.add_argument("--json", action="store_true", help="print one JSON object and nothing else")
    view = commands.add_parser("view", help="open a recording in the rerun viewer")
    view.add_argument("run", nargs="?", type=Path, help="results folder or .rrd (default: the newest recording)")
    view.add_argument("--web", action="store_true",
                      help="serve the viewer to a browser; chosen by itself without a display")  # fmt: skip
    video = commands.add_parser("video", help="write a clip of one run, or of two beside each other")
    video.add_argument("run", type=Path, nargs="+", help="one or two results folders; of a campaign the median walker")
    video.add_argument("--out", type=Path, default=Path("walk.mp4"), help="*.mp4 or *.gif (default: walk.mp4)")
    video.add_argument("--ghost", action="store_true", help="draw the second run as a shadow over the first")
    video.add_argument("--only", type=_whole, metavar="N", help="run N of a campaign")
    video.add_argument("--width", type=_whole, default=640, help="pixels (default: 640)")
    video.add_argument("--fps", type=_number, help="frames a second (default: 30; of a GIF 20)")
    video.add_argument("--from", dest="start", type=_number, default=0.0, metavar="S", help="begin at this time [s]")
    video.add_argument("--to", dest="end", type=_number, metavar="S", help="end at this time [s]")
    plot = commands.add_parser("plot", help="draw figures of a run or campaign")
    plot.add_argument("run", type=Path, help="results folder")
    report = commands.add_parser("report", help="write results as an HTML page, or campaigns as Markdown with figures")
    report.add_argument("run", type=Path, nargs="+",
                        help="results folders; of --html also those of compare, diff, tune, stability, standard, and "
                        "files of regress --json")  # fmt: skip
    report.add_argument("--html", type=Path, metavar="FILE", help="one HTML page: no network, phone, paper, dark")
    report.add_argument("--out", type=Path, help="the Markdown file (default: report.md, unless --html is given)")
    report.add_argument("--title", default="Campaigns", help="its heading")
    export = commands.add_parser("export", help="write results in other people's formats")
    export.add_argument("run", type=Path, help="results folder")
    export.add_argument("--eurobench", type=Path, required=True, metavar="DIR",
                        help="new folder for files as EuroBench's documents describe them")  # fmt: skip
    what = "Says what is recognised in a model file, and lists every fault at once, with what to write."
    model = commands.add_parser("model", help="what a model file is, and all that is wrong with it", description=what)
    model.add_argument("file", help="name in models/, or path of an MJCF or URDF file")
    model.add_argument("--json", action="store_true", help="print one JSON object and nothing else")
    bench = commands.add_parser("bench", help="run time against error, and what things cost")
    things = ["throughput", "walking", "mechanisms", "tolerances", "robot", "campaigns", "regress"]
    bench.add_argument("what", choices=things,
                       help="what to measure; tolerances: error of adaptive steps of mechanisms against what they were "
                       "asked for; robot: the bench experiments of Figs 4.7 and 4.8; campaigns: processes here against "
                       "a cluster, by the clock; regress: whether a recorded result or cost changed")  # fmt: skip
    bench.add_argument("--out", type=Path, help="walking, mechanisms, tolerances, robot: folder for figures")
    bench.add_argument(
        "--quick",
        action="store_true",
        help="mechanisms: fewer repeats and settings; throughput: no scenes and no prices of features; "
        "campaigns: fewer runs",
    )
    bench.add_argument("--update", action="store_true", help="regress: record the costs measured now")
    bench.add_argument("--reason", help="regress: why costs changed (needed by --update)")
    bench.add_argument("--file", type=Path, help="regress: file of references (default: that of the shipped scenarios)")
    bench.add_argument("--json", action="store_true", help="print one JSON object and nothing else")
    stability = commands.add_parser("stability", help="a gait as a limit cycle: return map and Floquet multipliers")
    stability.add_argument("scenario", nargs="?", help="name in scenarios/, or path of a scenario file")
    stability.add_argument("--reference", action="store_true", help="solve the walkers whose multipliers are known")
    stability.add_argument("--set", dest="changes", metavar="KEY=VALUE", action="append", default=[],
                           help="change a key (VALUE is TOML; repeatable)")  # fmt: skip
    _trust(stability)
    stability.add_argument("--engine", choices=["mujoco", "home"], help="the only engine (default: both)")
    stability.add_argument("--basin", action="store_true", help="also cut the basin of attraction: lean and speed")
    _who(stability)
    stability.add_argument("--out", type=Path, help="folder of figure and numbers (default: a new one below runs/)")
    stability.add_argument("--json", action="store_true", help="print one JSON object and nothing else")
    start = "Writes a control law to start from: the thesis's, in readable Python."
    new = commands.add_parser("new", help="write a file to start from", description=start)
    new.add_argument("what", choices=["controller"], help="what to start")
    new.add_argument("file", type=Path, help="the file, such as my_law.py; one that is there is not overwritten")
    what = "Works for a Dask scheduler: one thread a worker, watched by a nanny."
    worker = commands.add_parser("worker", help="work for campaigns on a cluster", description=what)
    worker.add_argument("scheduler", help="address of the scheduler, such as tcp://host:8786")
    worker.add_argument("--workers", type=_whole, default=1, help="workers, one core each (default: 1)")
    worker.add_argument("--lifetime", metavar="TIME", help="go after this time, such as 50m; keep it below a walltime")
    worker.add_argument("--memory", metavar="SIZE", default="auto", help="most memory of each, such as 2GB")
    for part in ("ca-file", "cert", "key"):
        worker.add_argument(f"--tls-{part}", metavar="FILE", help="of a scheduler at tls://…")
    worker.add_argument("--with-parent", action="store_true", help="go when standard input ends")
    commands.add_parser("list", help="models, controllers and scenarios, with a line each")
    return parser


def _who(command: argparse.ArgumentParser) -> None:
    command.add_argument("--jobs", type=_whole, help="processes (default: all cores)")
    where = "workers elsewhere instead: address of a Dask scheduler, local:N, or a file *.toml (docs/clusters.md)"
    command.add_argument("--cluster", metavar="WHERE", help=where)


def _same(command: argparse.ArgumentParser) -> None:
    what = "refuse workers and results of another kind of machine, whose last bits may differ"
    command.add_argument("--same-platform", action="store_true", help=what)


def _trust(command: argparse.ArgumentParser) -> None:
    command.add_argument("--trust", action="store_true", help="run a law of one's own that the scenario names")


def parsed(argv: Sequence[str] | None) -> argparse.Namespace:
    """The arguments of one command.

    Raises:
        InputError: They are not what a command takes.
    """
    for word in sys.argv[1:] if argv is None else argv:
        try:
            word.encode()
        except UnicodeEncodeError:
            raise InputError(f"{said(word)}: expected arguments in UTF-8") from None
    parser = _parser()
    args, unknown = parser.parse_known_args(argv)
    if unknown:
        from biped.base.files import nearest

        options = [option for action in _commands(parser)[args.command]._actions for option in action.option_strings]
        word = unknown[0]
        hint = nearest(word, [option for option in options if option.startswith("--")])
        raise InputError(f"{said(word)}: not something that biped {args.command} takes; {hint}")
    return args
