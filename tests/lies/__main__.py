"""`python -m tests.lies`: judges helped robots, dishonest runs and honest ones, and prints a confusion matrix.

A run that is judged is noted in a journal (`--journal`); the same command goes on where it was stopped. Exit code 1 if
a lie passed as a walk, a stand or a seat, or an honest run raised an alarm.
"""

from __future__ import annotations

import argparse
import json
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

from tests.lies.judge import FALSE, KINDS, judged


def _main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.lies")
    parser.add_argument("--of-each", type=int, default=2000)
    parser.add_argument("--kinds", nargs="+", default=list(KINDS), choices=KINDS)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--journal", type=Path)
    args = parser.parse_args()
    noted: dict[tuple[str, int], tuple[str, str]] = {}
    if args.journal is not None and args.journal.is_file():
        for line in args.journal.read_text(encoding="utf-8").splitlines():
            kind, number, group, found = json.loads(line)
            noted[kind, number] = group, found
    wanted = [(kind, number) for number in range(args.of_each) for kind in args.kinds]
    todo = [one for one in wanted if one not in noted]
    with ProcessPoolExecutor(args.jobs) as pool:
        for (kind, number), (group, found) in zip(todo, pool.map(_judged, todo), strict=True):
            noted[kind, number] = group, found
            if args.journal is not None:
                with open(args.journal, "a", encoding="utf-8") as file:
                    file.write(json.dumps([kind, number, group, found]) + "\n")
    _show({one: noted[one] for one in wanted})
    wrong = [(*one, *noted[one]) for one in wanted if noted[one][1] in FALSE[one[0]]]
    for kind, number, group, found in wrong:
        print(f"wrong: {kind} {number} ({group}): {found}")
    return int(bool(wrong))


def _judged(one: tuple[str, int]) -> tuple[str, str]:
    return judged(*one)


def _show(noted: dict[tuple[str, int], tuple[str, str]]) -> None:
    ends = sorted({found for _, found in noted.values()})
    groups = sorted({(kind, group) for (kind, _), (group, _) in noted.items()})
    counts = Counter((kind, group, found) for (kind, _), (group, found) in noted.items())
    print(f"| of | kind | {' | '.join(ends)} |")
    print(f"|---|---|{'---|' * len(ends)}")
    for kind, group in groups:
        print(f"| {kind} | {group} | {' | '.join(str(counts[kind, group, end] or '') for end in ends)} |")


if __name__ == "__main__":
    raise SystemExit(_main())
