"""`make boundscheck`: a second of every shipped scenario with compiled kernels that check every index.

numba checks none by itself: a kernel that reads beyond an array reads whatever lies there. Kernels that check are
compiled anew into a folder of their own (minutes). Exit code 1 if one reads or writes beyond an array.
"""

from __future__ import annotations

import os
import sys
import tempfile

os.environ["NUMBA_BOUNDSCHECK"] = "1"  # before numba is imported
os.environ.setdefault("NUMBA_CACHE_DIR", tempfile.mkdtemp(prefix="biped-boundscheck-"))

import numba
import numpy as np

from biped.base.errors import InputError
from biped.base.files import names
from biped.base.trust import trusting
from biped.ensemble.campaign import run_one
from biped.ensemble.plan import Plan
from biped.studies.planned import plan_of

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


def main() -> int:
    """Runs all; prints those in which an index is wrong."""
    if not notices():
        print("indices are not checked: NUMBA_BOUNDSCHECK has no effect here")
        return 1
    wrong, count = 0, 0
    for name in names("scenarios"):
        try:
            with trusting(everything=True):
                run_one(short(name), 0)
            count += 1
        except InputError as error:
            print(f"{name}: not run: {error}", flush=True)
        except IndexError as error:
            wrong += 1
            print(f"{name}: {error}", flush=True)
    print(f"{count} scenarios for a second each, {wrong} with an index beyond an array")
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
