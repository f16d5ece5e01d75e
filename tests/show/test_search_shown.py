"""`biped tune` says how many walk with the gait that was found, and whether it is better than the one before."""

from __future__ import annotations

from pathlib import Path

import pytest

from biped.show.document import Paragraph, Table
from biped.show.searches import search_document
from biped.studies.tune import Tuned
from biped.studies.tune.search import SearchResult, Tally
from biped.studies.tune.search_space import Candidate


def found(cost: float, before: float, generation: int = 5) -> Tuned:
    tallies = {"level": Tally(40, 40, 0.7, 0.1), "push": Tally(0, 40, float("nan"), float("nan"))}
    start = {"level": Tally(39, 40, 0.6, 0.2), "push": Tally(1, 40, 0.5, 0.3)}
    result = SearchResult(Candidate(None, ()), generation, cost, tallies, before, start)
    return Tuned("tune/x", Path("runs/x"), Path("runs/x/gait.toml"), result, {}, 100, 4.0, 4.0)


@pytest.mark.parametrize(("cost", "before", "no_better"), [(0.1, 0.2, False), (0.2, 0.1, True), (0.2, 0.2, True)])
def test_a_search_says_whether_it_found_a_better_gait(cost, before, no_better):
    document = search_document(found(cost, before))
    (table,) = [block for block in document if isinstance(block, Table)]
    assert [(row[0], row[1], row[3]) for row in table.rows] == [
        ("level", "40 of 40", "39 of 40"),
        ("push", "0 of 40", "1 of 40"),
    ]
    assert table.rows[0][2] == "91 – 100 %"
    words = " ".join(str(block.line) for block in document if isinstance(block, Paragraph))
    assert ("no worse than what it found" in words) == no_better
    assert "100 runs, 25.0 a second" in words
    assert "runs/x/gait.toml" in words


def test_a_search_that_found_nothing_better_says_so():
    words = " ".join(str(block.line) for block in search_document(found(0.2, 0.2, 0)) if isinstance(block, Paragraph))
    assert "nothing better than the gait that it began with" in words
    assert "no worse than what it found" not in words
