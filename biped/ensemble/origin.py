"""What runs are made of and with: rows of different origin are never mixed in one journal."""

from __future__ import annotations

from hashlib import blake2b
from pathlib import Path

from biped.base import VERSION
from biped.base.platform import here, sources
from biped.ensemble.plan import Plan
from biped.robot.planar.description import description_of
from biped.scenario.laws import own_law
from biped.scenario.reading import to_toml

PLACE = ("system", "libc", "instructions")
"""Of an origin, what kind of machine it is: on another kind, the last bits may be others."""


def origin_of(plan: Plan) -> dict[str, str]:
    """Digest of the effective scenario with the model, its description and the law; versions; and platform."""
    state = blake2b(to_toml(plan.scenario).encode(), digest_size=8)
    law = plan.scenario.law
    files = [Path(law.rpartition(":")[0])] if law is not None and own_law(law) else []
    for path in (plan.model, description_of(plan.model), *files):
        state.update(path.read_bytes())
    return {"scenario": state.hexdigest(), "biped": VERSION, "kernels": sources(), **here()}
