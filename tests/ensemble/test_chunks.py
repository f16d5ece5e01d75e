"""Chunks of a campaign: what travels to those who make them, and how runs are dealt."""

from __future__ import annotations

from pathlib import Path

import pytest

from biped.ensemble import chunks
from biped.ensemble.chunks import Chunks, Deal
from biped.ensemble.parts import Chunk
from biped.ensemble.plan import Plan
from biped.scenario.reading import from_text, read_scenario, to_toml

pytestmark = pytest.mark.usefixtures("folder")


def test_a_scenario_travels_as_text():
    plan = Plan(read_scenario("e.toml"))
    assert Plan(from_text(to_toml(plan.scenario), Path("scenario.toml"))).scenario == plan.scenario
    make, arguments = Chunks(plan).__reduce__()
    assert [type(argument) for argument in arguments] == [str, str]
    assert make(*arguments)(Chunk(2, 2)).data == Chunks(plan)(Chunk(2, 2)).data
    with pytest.raises(Exception, match="model, gait or law of this scenario are other files there"):
        make(arguments[0], "another digest")


def test_runs_are_dealt_once_in_chunks_of_a_time():
    deal = Deal([range(0, 5000), range(6000, 9000)])
    seen = []
    while (chunk := deal.dealt(4)) is not None:
        seen += range(chunk.first, chunk.first + chunk.runs)
        deal.took(chunks.FinishedChunk(chunk, b"", 0.05 * chunk.runs, "", ""))
        assert 0.05 * chunk.runs <= chunks.SECONDS * 1.01
    assert seen == [*range(0, 5000), *range(6000, 9000)]
    deal.halve(Chunk(10, 5))
    assert [deal.dealt(4), deal.dealt(4), deal.dealt(4)] == [Chunk(10, 2), Chunk(12, 3), None]
