"""The table [expect] of a scenario file: bounds of metrics, counts of runs also as shares of them."""

import math
import re
from collections.abc import Callable, Mapping

from biped.base.errors import InputError
from biped.base.text import echo
from biped.scenario.metrics import METRICS, Metric
from biped.scenario.section import Section

_SHARE = re.compile(r"(\d+(?:\.\d+)?) ?%")


class Bound(Section, frozen=True):
    """The expected value of a metric, its mean over the runs that walked; `falls`, `walked`, `stood`, `sat` count runs.

    A count is a whole number of runs, or a share of them such as `"97 %"`, which holds for any number of runs: it is
    met when Wilson's 95 % interval of the runs' rate lies within it, missed when the interval lies outside it, and
    undecided otherwise. `"100 %"` and `"0 %"` mean all of these runs and none of them.

    Attributes:
        min: Smallest value.
        max: Largest value.
    """

    min: float | str | None = None
    max: float | str | None = None


def share_of(bound: float | str) -> float | None:
    """The share 0 … 1 that a bound asks for; None where it is a number."""
    found = _SHARE.fullmatch(bound) if isinstance(bound, str) else None
    return None if found is None else float(found[1]) / 100.0


def check_bounds(expect: Mapping[str, Bound], fail: Callable[[str, str], InputError]) -> None:
    """Refuses bounds that no metric can have.

    Args:
        expect: Bounds by the name of a metric.
        fail: Makes an error of a dotted key and what is wrong with it.

    Raises:
        InputError: A bound is no number or share, or they contradict each other.
    """
    for name, bound in expect.items():
        given = {which: value for which in ("min", "max") if (value := getattr(bound, which)) is not None}
        if not given:
            raise fail(f"expect.{name}", "expected min, max or both")
        for which, value in given.items():
            _check(METRICS[name], value, lambda what, at=f"expect.{name}.{which}": fail(at, what))
        if len(given) < 2:
            continue
        shares = [share_of(value) for value in given.values()]
        if (shares[0] is None) != (shares[1] is None):
            raise fail(f"expect.{name}", "expected min and max both as numbers or both as shares")
        low, high = (value if share is None else share for value, share in zip(given.values(), shares, strict=True))
        if low > high:
            raise fail(f"expect.{name}", f"expected min <= max, got {bound.min} > {bound.max}")


def _check(metric: Metric, value: float | str, fail: Callable[[str], InputError]) -> None:
    share = share_of(value)
    if metric.kind != "count":
        if isinstance(value, str):
            more = "; only counts of runs may be shares" if share is not None else ""
            raise fail(f"expected a number, got {echo(value)}{more}")
        return
    if share is not None:
        if share > 1.0:
            raise fail(f"expected a share of the runs, 0 % … 100 %, got {echo(value)}")
        return
    if isinstance(value, str) or value < 0.0 or not math.isfinite(value) or value != int(value):
        raise fail(f'expected a whole number of runs, or a share of them such as "97 %", got {echo(value)}')
