"""A gait part of the way to another one: its numbers, what stays, and mistakes."""

from __future__ import annotations

import pytest

from biped.base.errors import InputError
from biped.base.files import locate
from biped.ensemble.journal import files_read_by
from biped.ensemble.plan import Plan
from biped.scenario.gains import Gains
from biped.scenario.gait import read_gains, read_settings
from biped.scenario.reading import read_scenario

OTHER = """
extends = "normal"
k_d1 = 900.0
theta_b = 60.0

[actuation.pushing]
approach = 0.05

[start]
posture = "single"
"""
MINE = """
extends = "normal"
k_d1 = 500.0
theta_b = 80.0

[actuation.pushing]
approach = 0.01
slew = 40.0

[start]
posture = "flat"

[toward]
gait = "other.toml"
share = 0.25
"""


@pytest.fixture
def gait(tmp_path):
    def written(mine=MINE, other=OTHER):
        (tmp_path / "other.toml").write_text(other, encoding="utf-8")
        (tmp_path / "mine.toml").write_text(mine, encoding="utf-8")
        return tmp_path / "mine.toml"

    return written


def test_every_number_that_both_have_lies_between_theirs(gait):
    gains = read_gains(gait(), Gains())
    assert (gains.k_d1, gains.theta_b) == (600.0, 75.0)
    assert gains.k_d2 == read_gains(locate("controllers", "normal", ""), Gains()).k_d2, "where both agree"


def test_what_only_one_has_stays_and_so_does_the_start(gait):
    settings, _ = read_settings(gait())
    pushing = settings["actuation"]["pushing"]
    assert (pushing.approach, pushing.slew) == (pytest.approx(0.02), 40.0)
    assert settings["start"] == {"posture": "flat"}
    bare, _ = read_settings(gait(MINE.replace("slew = 40.0", ""), OTHER + "[backstep]\nbend = 1.0\n"))
    assert "backstep" not in bare


def test_the_ends_are_the_gaits_themselves(gait):
    for share, k_d1 in ((0.0, 500.0), (1.0, 900.0)):
        assert read_gains(gait(MINE.replace("0.25", str(share))), Gains()).k_d1 == k_d1


def test_a_gait_may_move_toward_one_that_moves_too(gait, tmp_path):
    (tmp_path / "third.toml").write_text('extends = "normal"\nk_d1 = 100.0\n', encoding="utf-8")
    path = gait(other=OTHER + '\n[toward]\ngait = "third.toml"\nshare = 0.5\n')
    assert read_gains(path, Gains()).k_d1 == 500.0, "no way at all: the other is at 500, too"
    assert tmp_path / "third.toml" in read_settings(path)[1].keys.values()


def test_a_campaign_that_varies_its_gait_reads_the_other_file_too(gait, tmp_path):
    path = gait()
    scenario = read_scenario("robust/own", [f'sweep.controller=["{path}", "normal"]'])
    assert tmp_path / "other.toml" in files_read_by(Plan(scenario))


@pytest.mark.parametrize(
    ("mine", "other", "words"),
    [
        (MINE.replace("other.toml", "mine.toml"), OTHER, ["mine.toml", "toward.gait", "toward each other"]),
        (MINE, OTHER + '[toward]\ngait = "mine.toml"\nshare = 0.5\n', ["toward each other", "mine.toml"]),
        (MINE.replace("other.toml", "normol"), OTHER, ["toward.gait", "normol", "normal"]),
        (MINE.replace("0.25", "1.25"), OTHER, ["toward.share", "1.25"]),
        (MINE.replace("share =", "shore ="), OTHER, ["toward.shore", "share"]),
        (MINE.replace("share = 0.25", ""), OTHER, ["toward", "share"]),
        ('toward = "other.toml"\nextends = "normal"\n', OTHER, ["toward", "expected a table, [toward]"]),
        (MINE, OTHER + "[[speeds]]\nat = 1.0\n", ["toward.gait", "[[speeds]]"]),
        (MINE, 'unit = "m g l"\n' + OTHER, ["toward.gait", "the same unit"]),
        (MINE, OTHER.replace("k_d1", "k_d9"), ["other.toml", "k_d9", "unknown key"]),
        (MINE, OTHER.replace("900.0", '"stiff"'), ["other.toml", "k_d1", "number"]),
        (MINE, OTHER.replace("900.0", "-1.0"), ["other.toml", "k_d1"]),
        (MINE + '[actuation]\ncontacts = "pushing"\n', OTHER + '[actuation]\ncontacts = "released"\n',
         ["mine.toml", "actuation.contacts", "pushing", "released"]),
    ],
)  # fmt: skip
def test_mistakes_are_named(gait, mine, other, words):
    path = gait(mine, other)
    with pytest.raises(InputError) as error:
        read_gains(path, Gains())
    for word in words:
        assert word in str(error.value)
