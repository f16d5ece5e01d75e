"""`make boundscheck`: a second of every shipped scenario with compiled kernels that check every index.

numba checks none by itself: a kernel that reads beyond an array reads whatever lies there. Kernels that check are
compiled anew into a folder of their own (minutes). Exit code 1 if one reads or writes beyond an array.

With `--noted FILE` and a folder for the kernels in `NUMBA_CACHE_DIR` the same command goes on where it was stopped.
Scenarios of different folders, and so of different kernels, come first.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from pathlib import Path

os.environ["NUMBA_BOUNDSCHECK"] = "1"  # before numba is imported
os.environ.setdefault("NUMBA_CACHE_DIR", tempfile.mkdtemp(prefix="biped-boundscheck-"))

import numba
import numpy as np

from biped.base.errors import InputError
from biped.base.files import names
from biped.base.trust import trusting
from biped.ensemble.campaign import run_one
from biped.ensemble.plan import Plan
from biped.studies.run import plan_of

SECOND = ["duration=1.0", "window.start=0.0", "window.end=1.0"]
NOTHING_LATER = [
    [],
    ["push=[]"],
    ["change=[]"],
    ["push=[]", "change=[]", "randomise.draw={}", "sweep={}"],
]
"""What is taken away of a scenario, as little as it takes, for what comes after a second."""


def short(name: str) -> Plan:
    """The first second of a scenario.

    Raises:
        InputError: It cannot be so short.
    """
    for less in NOTHING_LATER[:-1]:
        try:
            plan = plan_of(name, [*SECOND, *less])
            plan.run(0)
        except InputError:
            continue
        return plan
    return plan_of(name, [*SECOND, *NOTHING_LATER[-1]])


@numba.njit
def _beyond(x: np.ndarray) -> float:
    return x[len(x)]


def notices() -> bool:
    """Whether an index beyond an array is noticed."""
    try:
        _beyond(np.zeros(2))
    except IndexError:
        return True
    return False


def checked(name: str) -> str:
    """The outcome of a second of a scenario: `ok`, `wrong: …` where an index is, or why it was `not run: …`."""
    try:
        with trusting(everything=True):
            run_one(short(name), 0)
    except InputError as error:
        return f"not run: {error}"
    except IndexError as error:
        return f"wrong: {error}"
    return "ok"


def in_turn(found: list[str]) -> list[str]:
    """Names of scenarios: the first of every folder, then the second, and so on."""
    folders = [name.rpartition("/")[0] for name in found]
    place = [folders[:number].count(folder) for number, folder in enumerate(folders)]
    return [name for _, name in sorted(zip(place, found, strict=True))]


def main() -> int:
    """Runs all; prints those in which an index is wrong."""
    parser = argparse.ArgumentParser(prog="python -m tests.boundscheck")
    parser.add_argument("--noted", type=Path, help="file of what has been run, which is not run again")
    file = parser.parse_args().noted
    if not notices():
        print("indices are not checked: NUMBA_BOUNDSCHECK has no effect here")
        return 1
    lines = file.read_text(encoding="utf-8").splitlines() if file is not None and file.is_file() else []
    noted = dict(line.split("\t", 1) for line in lines)
    for name in in_turn(names("scenarios")):
        if name in noted:
            continue
        noted[name] = " ".join(checked(name).split())
        if noted[name] != "ok":
            print(f"{name}: {noted[name]}", flush=True)
        if file is not None:
            with file.open("a", encoding="utf-8") as out:
                out.write(f"{name}\t{noted[name]}\n")
    wrong = sum(one.startswith("wrong") for one in noted.values())
    ran = sum(one == "ok" for one in noted.values())
    print(f"{ran} of {len(noted)} scenarios for a second each without an error, {wrong} with an index beyond an array")
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
