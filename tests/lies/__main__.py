"""`python -m tests.lies`: judges helped robots, dishonest runs and honest ones, and prints a confusion matrix.

A run that is judged is noted in a journal (`--journal`); the same command goes on where it was stopped. `--write` puts
the tables of the journal into the docs. Exit code 1 if a lie passed as a walk, a stand or a seat, or an honest run
raised an alarm.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from itertools import islice
from pathlib import Path

from tests.lies.honest import every_run
from tests.lies.judge import FALSE, HONEST, KINDS, Judged, judged
from tests.lies.power import KINDS_OF_HELP, weakest
from tests.lies.tables import Noted, confusion, floor, honest, power, sums, write

OF_A_POLICY = 10
AHEAD = 16
"""Cases on their way: what a kill of the command costs."""


def _main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.lies")
    parser.add_argument("--of-each", type=int, default=2000, help="cases of every kind that is drawn")
    parser.add_argument("--kinds", nargs="+", default=[*KINDS, "power"], choices=[*KINDS, "power"])
    parser.add_argument("--policies", nargs="+", default=[], help="scenarios of policies, by path; ten runs of each")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--journal", type=Path)
    parser.add_argument("--noted", action="store_true", help="carry out nothing: the tables of what is noted")
    parser.add_argument("--write", action="store_true", help="put the tables into docs/")
    args = parser.parse_args()
    policies = tuple(str(Path(path).resolve()) for path in args.policies)
    counts = {"shipped": len(every_run()) if "shipped" in args.kinds else 0, "policy": OF_A_POLICY * len(policies),
              "power": len(KINDS_OF_HELP)}  # fmt: skip
    most = {kind: counts.get(kind, args.of_each) for kind in args.kinds}
    wanted = [(kind, number) for number in range(max(most.values())) for kind in args.kinds if number < most[kind]]
    noted = {} if args.journal is None else _read(args.journal)
    if args.noted:
        wanted = [one for one in wanted if one in noted]
    todo = iter([one for one in wanted if one not in noted])
    with ProcessPoolExecutor(args.jobs) as pool:
        while some := list(islice(todo, AHEAD)):
            for one, found in zip(some, pool.map(partial(_one, policies=policies), some), strict=True):
                noted[one] = found
                if args.journal is not None:
                    with open(args.journal, "a", encoding="utf-8") as file:
                        file.write(json.dumps([*one, *found]) + "\n")
    found = {one: noted[one] for one in wanted}
    tables = {"sums": sums(found), "confusion": confusion(found), "floor": floor(found), "power": power(found),
              "honest": honest(found)}  # fmt: skip
    for name, table in tables.items():
        print(f"{name}\n\n{table}\n")
    if args.write:
        write(tables)
    wrong = list(_wrong(found))
    for line in wrong:
        print(f"wrong: {line}")
    return int(bool(wrong))


def _one(one: tuple[str, int], policies: tuple[str, ...]) -> Judged:
    kind, number = one
    return weakest(number) if kind == "power" else judged(kind, number, policies)


def _read(journal: Path) -> dict[tuple[str, int], Judged]:
    if not journal.is_file():
        return {}
    lines = [json.loads(line) for line in journal.read_text(encoding="utf-8").splitlines()]
    return {(kind, number): Judged(*found) for kind, number, *found in lines}


def _wrong(found: Noted) -> Iterator[str]:
    for (kind, number), one in found.items():
        if one.found in FALSE.get(kind, ()) or (kind in HONEST and one.found == "refused"):
            yield f"{kind} {number} ({one.group}): {one.found}"


if __name__ == "__main__":
    raise SystemExit(_main())
