"""What a search leaves behind: a gait file that says how it was found."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import msgspec

from biped.base.statistics import wilson
from biped.base.typed import convert
from biped.scenario.gains import GAINS, OUT_OF_PLANE, Gains
from biped.scenario.settings import GAIT, made_for
from biped.scenario.vary import Asked, with_values
from biped.studies.tune.search import Record, Search, SearchResult, Tally


def gait_text(title: str, search: Search, found: SearchResult, journal: Sequence[Record] | None = None) -> str:
    """The gait as a controller file; its head says how it was found and what it scored on unseen seeds.

    Args:
        title: Name of the tuning scenario.
        search: Its last stage.
        found: What that found.
        journal: Generations of all stages; default: the search's own.
    """
    import tomli_w

    study, tune = search.study, search.study.tune
    start = study.scenario.controller
    candidate = found.candidate
    journal = search.journal if journal is None else journal
    runs = sum(record["runs"] for record in journal)
    lines = [
        f"Found by `biped tune {title}` with seed {study.scenario.seed}: CMA-ES over {len(search.space.axes)} numbers",
        f"from the gait '{start}', {len(journal)} generations of {tune.population} ({runs} runs); this is the "
        f"mean of generation {found.generation}.",
        f"On {tune.unseen} runs per condition with seeds never used before (walked, 95 % interval; before: {start}):",
        *(_line(name, tally, found.start_tallies[name]) for name, tally in found.tallies.items()),
        f"objective {found.cost:.4f}, before {found.start_cost:.4f}",
    ]
    settings = made_for(with_values(study.scenario, dict(candidate.keys), Asked("tune.keys")))
    others = [(key, value) for key, value in candidate.keys if key.partition(".")[0] not in GAIT]
    if others:
        lines += ["It was found together with these settings, which a scenario must have:"]
        lines += [f"  {key} = {value:g}" for key, value in others]
    head = "".join(f"# {line}\n" for line in lines)
    data = {
        "description": f"Found by biped tune {title}",
        "source": f"biped tune {title}, seed {study.scenario.seed}",
        **{
            name: _plain(value)
            for name in (*GAINS, *OUT_OF_PLANE)
            if (value := getattr(candidate.gains, name)) is not None
        },
        **{name: {key: _plain(value) for key, value in table.items()} for name, table in settings.items()},
    }
    return head + "\n" + tomli_w.dumps(data)


def _plain(value: Any) -> Any:
    """A setting as TOML has it; one that is a table holds all its keys."""
    value = msgspec.to_builtins(value)
    return list(value) if isinstance(value, tuple) else value


def _line(name: str, tally: Tally, before: Tally) -> str:
    low, high = wilson(tally.walked, tally.runs)
    return (
        f"  {name}: {tally.walked}/{tally.runs} ({low:.0%} – {high:.0%}), {tally.speed:.2f} m/s, "
        f"cost of transport {tally.cost_of_transport:.3f}; before {before.walked}/{before.runs}"
    )


def gait_of(text: str) -> Gains:
    """The gains in a text that `gait_text` made."""
    import tomllib

    data = tomllib.loads(text)
    return convert({key: data[key] for key in (*GAINS, *OUT_OF_PLANE) if key in data}, Gains)
