"""docs/scenarios.md is what its generator writes; every key says what it means."""

from __future__ import annotations

from typing import get_type_hints

import msgspec
import pytest

from biped.base.typed import Section
from biped.scenario.goals import Tune
from biped.scenario.keys import Scenario
from biped.scenario.reference import PAGE, meanings, page

SECTIONS = sorted({kind for kind in Section.__subclasses__() if kind.__module__.startswith("biped.scenario.")},
                  key=lambda kind: kind.__name__)  # fmt: skip


def test_the_page_is_what_the_docstrings_say():
    assert PAGE.read_text(encoding="utf-8") == page(), "make docs"


@pytest.mark.parametrize("kind", SECTIONS)
def test_every_key_says_what_it_means(kind):
    assert list(meanings(kind)) == [name for name in get_type_hints(kind) if name in kind.__struct_fields__]
    assert all(text.endswith(".") for text in meanings(kind).values())


def test_every_key_is_on_the_page():
    text = page()
    for at, kind in (("", Scenario), ("tune.", Tune)):
        for name in kind.__struct_fields__:
            assert f"`{at}{name}`" in text or f"[{at}{name}]" in text
    for value in msgspec.to_builtins(Scenario().ground):
        assert f"`ground.{value}`" in text or f"`[ground.{value}]`" in text
    assert '`randomise.draw."KEY".uniform`' in text
    assert "`expect.METRIC.min`" in text
    assert "| number 0 … 1000 |" in text
