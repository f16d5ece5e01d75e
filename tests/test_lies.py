"""No lie walks, stands or sits, and no honest run raises an alarm; `python -m tests.lies` judges thousands."""

from __future__ import annotations

from collections import Counter

import pytest

from tests.lies.judge import FALSE, KINDS, judged


def outcomes(kind: str, count: int) -> Counter[str]:
    found = {number: judged(kind, number) for number in range(count)}
    wrong = {number: one for number, one in found.items() if one[1] in FALSE[kind]}
    assert not wrong
    return Counter(word for _, word in found.values())


def test_parts_that_hold_a_robot_are_refused():
    assert outcomes("part", 40) == {"refused": 40}


@pytest.mark.parametrize("kind", KINDS[1:])
def test_a_few_of_each_kind(kind):
    assert outcomes(kind, 6).total() == 6


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_a_hundred_of_each_kind(kind):
    found = outcomes(kind, 100)
    assert found["alarm"] == 0
    if kind in ("law", "part, unnamed"):
        assert found["held"] >= 50, found
