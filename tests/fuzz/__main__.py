"""`make fuzz`: thousands of cases; prints what is wrong and how to repeat it. Exit code 1 if anything is.

Every hundred cases run in a process of their own, so that one that takes it down costs the rest nothing.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from tests.fuzz.cases import case
from tests.fuzz.harness import fault, warm

CHUNK = 100


def _chunk(seed: int, first: int, last: int) -> None:
    """In a process of its own: one line per case."""
    for number in range(first, last):
        print(f"begin {number}", flush=True)
        kind, made = case(seed, number)
        ended, wrong = fault(made)
        print(f"end {number} {kind} {ended} {' '.join((wrong or '').split())[:2000]}", flush=True)


def _carried_out(seed: int, first: int, last: int) -> tuple[Counter[str], list[str]]:
    ends: Counter[str] = Counter()
    faults = []
    while first < last:
        done = subprocess.run(
            [sys.executable, "-m", "tests.fuzz", "--seed", str(seed), "--chunk", str(first), str(last)],
            capture_output=True, encoding="utf-8", errors="backslashreplace", check=False,
            cwd=Path(__file__).parents[2],
        )  # fmt: skip
        at = first
        for line in done.stdout.splitlines():
            word, number, *rest = line.split(" ", 4)
            at = int(number)
            if word == "end":
                kind, ended, wrong = (*rest, "")[:3]
                ends[f"{kind} {ended}"] += 1
                if wrong:
                    faults.append(f"{number} ({kind}): {wrong}")
                first = at + 1
        if done.returncode != 0 and first < last:  # killed: a crash of a library
            faults.append(f"{at}: the process ended with {done.returncode}: {done.stderr[-300:]!r}")
            first = at + 1
    return ends, faults


def _main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz")
    parser.add_argument("--cases", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--from", dest="start", type=int, default=0)
    parser.add_argument("--chunk", type=int, nargs=2, help=argparse.SUPPRESS)
    args = parser.parse_args()
    if args.chunk:
        _chunk(args.seed, *args.chunk)
        return 0
    ends: Counter[str] = Counter()
    wrong: list[str] = []
    stop = args.start + args.cases
    starts = range(args.start, stop, CHUNK)
    warm()  # from a cold cache: compiled once, and not by every chunk's process side by side
    with ThreadPoolExecutor(args.jobs) as pool:
        for done in pool.map(lambda first: _carried_out(args.seed, first, min(first + CHUNK, stop)), starts):
            ends += done[0]
            wrong += done[1]
            for line in done[1]:
                print(line, flush=True)
    for name, count in sorted(ends.items()):
        print(f"{count:6} {name}")
    again = f"python -m tests.fuzz --seed {args.seed} --from N --cases 1"
    print(f"{args.cases} cases, {len(wrong)} wrong; one again: {again}")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(_main())
