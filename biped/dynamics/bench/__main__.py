"""`python -m biped.dynamics.bench`: the benches of chapter II; `biped bench` hands its own over to it."""

import argparse
import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from biped.base.writing import dumps
from biped.dynamics.bench import chapter2, experiments, figures, mechanisms, tables, tolerances


def main(argv: Sequence[str] | None = None) -> int:
    """Measures one thing; prints a table or JSON, and draws figures into a folder if there is one.

    Args:
        argv: The words after the command; default: those of the process.

    Returns:
        The exit code.
    """
    parser = argparse.ArgumentParser(prog="biped bench", description="Run time against error of mechanisms.")
    parser.add_argument("bench", choices=("mechanisms", "tolerances", "robot"))
    parser.add_argument("--quick", action="store_true", help="mechanisms: fewer repeats and settings")
    parser.add_argument("--json", action="store_true", help="print one JSON object and nothing else")
    parser.add_argument("--out", type=Path, metavar="DIR", help="folder for figures")
    args = parser.parse_args(argv)
    if args.bench == "mechanisms":
        report = mechanisms.measure(args.quick, _progress)
        if args.json:
            print(dumps(asdict(report)))
        else:
            tables.print_mechanisms(report)
        if args.out is not None:
            figures.draw_work_precision(report.points, args.out)
            chapter2.draw(args.out)
    elif args.bench == "tolerances":
        reached = tolerances.measure(progress=_progress)
        if args.json:
            print(dumps({"runs": [asdict(r) for r in reached]}))
        else:
            tables.print_tolerances(reached)
        if args.out is not None:
            figures.draw_tolerances(reached, args.out)
    else:
        experiment = experiments.measure()
        if args.json:
            print(dumps(experiment.as_dict()))
        else:
            tables.print_experiments(experiment)
        if args.out is not None:
            figures.draw_experiments(experiment, args.out)
    return 0


def _progress(line: str) -> None:
    """Names on stderr what starts, if a person watches."""
    if sys.stderr.isatty():
        print(line, file=sys.stderr)


if __name__ == "__main__":
    sys.exit(main())
