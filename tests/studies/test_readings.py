"""The study of readings: its definition, its score, what it tries next, and how it is shown."""

from __future__ import annotations

import pytest

from biped.base.errors import InputError
from biped.cli.main import main
from biped.scenario.keys import Scenario
from biped.scenario.reading import read_scenario
from biped.scenario.vary import SWEEP, lookup, with_values
from biped.show.readings import PAGE, THESIS, distribution, page, places, stored, thesis, verdict
from biped.studies import readings as searched
from biped.studies.readings import (
    Claim,
    Outcome,
    TriedReading,
    agreement,
    based,
    best,
    definition,
    outcome_of,
    proposal,
    score,
    search,
)

CLAIM = Claim("c", "level_normal", "Fig", 2, 1.0, share=0.5, printed={"speed": 1.0})


def tried(score: float, **changes: object) -> TriedReading:
    return TriedReading("bounded", {key.replace("__", "."): value for key, value in changes.items()}, {}, score)  # type: ignore[arg-type]


def test_every_place_is_a_key_whose_alternatives_are_possible():
    s = read_scenario("level_normal")
    base = based(definition())
    for place in definition().place:
        lookup(s, place.key, SWEEP)
        assert base[place.key] in place.values, place.key
        for value in place.values:
            with_values(s, {place.key: value}, SWEEP)


def test_claims_are_of_published_gaits_and_their_numbers_the_scenarios():
    for claim in definition().claim:
        s = read_scenario(claim.scenario)
        assert s.controller in {"slow", "normal", "fast", "style", "uphill", "downhill"}
        assert s.gains == Scenario().gains, "gains are never touched"
        if claim.printed:
            assert claim.printed == s.thesis


def test_a_claim_that_comes_out_as_printed_counts_one():
    assert agreement(definition(), CLAIM, Outcome(4, 2, {"speed": 1.0})) == pytest.approx(1.0)
    assert agreement(definition(), CLAIM, Outcome(4, 0, {})) == 0.0
    off = 1.0 + definition().scale["speed"] * definition().most / 2
    assert agreement(definition(), CLAIM, Outcome(4, 1, {"speed": off})) == pytest.approx((2 * 0.5 + 0.5) / 3)


def test_the_score_is_a_mean_of_the_claims():
    study = definition()
    as_printed = {claim.name: Outcome(10, 10, claim.printed) for claim in study.claim}
    assert score(study, as_printed) == pytest.approx(1.0)
    lost = study.claim[0]
    without = as_printed | {lost.name: Outcome(10, 0, {})}
    assert score(study, without) == pytest.approx(1.0 - lost.weight / sum(claim.weight for claim in study.claim))


def test_means_are_of_the_runs_that_walked():
    rows = [{"walked": True, "speed": 1.0}, {"walked": True, "speed": None}, {"walked": False, "speed": 9.0}]
    assert outcome_of(rows, {"speed": 1.0}) == Outcome(3, 2, {"speed": 1.0})


def test_first_come_the_base_and_listed_readings_and_single_changes_then_changes_of_the_best():
    study = definition()
    made: list[TriedReading] = []
    first = 1 + len(study.first)
    listed = first + sum(len(place.values) - 1 for place in study.place)
    for i in range(listed + 40):
        changes = proposal(study, made)
        assert changes not in [one.changes for one in made]
        if i < first:
            assert changes == [{}, *study.first][i]
        elif i < listed:
            assert len(changes) == 1
        good = changes.get("actuation.torque_limit") == 300.0 and i >= first
        made.append(TriedReading("bounded", changes, {}, 0.5 if i < first or good else 0.3))
    assert sum("actuation.torque_limit" in one.changes for one in made[listed:]) > 20
    assert best(made)[0].score == 0.5
    assert proposal(study, made) == proposal(study, made)


def test_changes_that_did_badly_alone_are_seldom_proposed():
    study = definition()
    bad = {"actuation.contacts": "touching"}
    listed = 1 + len(study.first) + sum(len(place.values) - 1 for place in study.place)
    made: list[TriedReading] = []
    while len(made) < listed + 60:
        changes = proposal(study, made)
        made.append(TriedReading("bounded", changes, {}, 0.1 if bad.items() <= changes.items() else 0.5))
    assert not any(bad.items() <= one.changes.items() for one in made[listed:])


def test_an_interrupted_search_goes_on(tmp_path, monkeypatch):
    asked = []

    def trial(study, reading, changes, seed, runs, jobs):
        asked.append(changes)
        return TriedReading(reading, changes, {"slow": Outcome(1, 1, {"speed": 0.5})}, 0.5)

    monkeypatch.setattr(searched, "trial", trial)
    first = search(3, 1, tmp_path)
    again = search(5, 1, tmp_path)
    assert again[:3] == first
    assert len(asked) == 5


def test_verdicts():
    study = definition()
    assert verdict(study, CLAIM, Outcome(10, 5, {"speed": 1.04})) == "reproduced"
    assert verdict(study, CLAIM, Outcome(10, 5, {"speed": 1.06})) == "partly"
    assert verdict(study, CLAIM, Outcome(10, 4, {"speed": 1.0})) == "partly"
    assert verdict(study, CLAIM, Outcome(10, 2, {"speed": 1.0})) == "not"
    assert verdict(study, CLAIM, Outcome(10, 0, {})) == "not"


def test_what_a_change_alone_does_is_shown_beside_what_the_thesis_says():
    text = places(definition(), [tried(0.5), tried(0.4, actuation__limit="clip")])
    line = next(line for line in text.splitlines() if "`actuation.limit`" in line)
    assert "clip: −0.100; **bounded**" in line
    assert "2 readings were tried" in distribution([tried(0.5), tried(0.4, actuation__limit="clip")])


def test_the_pages_are_what_was_kept():
    assert PAGE.read_text(encoding="utf-8") == page(stored())
    assert THESIS.read_text(encoding="utf-8") == thesis(stored())


@pytest.mark.parametrize("argv", [["--tries", "-1"], ["--confirm", "0"]])
def test_counts_are_checked(argv, capsys):
    assert main(["readings", *argv]) == 2
    assert argv[0] in capsys.readouterr().err


def test_another_study_is_not_continued(tmp_path, monkeypatch):
    monkeypatch.setattr(searched, "trial", lambda *_: TriedReading("bounded", {}, {}, 0.5))
    search(1, 1, tmp_path)
    monkeypatch.setattr(searched, "digest", lambda: "another")
    with pytest.raises(InputError, match="study"):
        search(2, 1, tmp_path)
