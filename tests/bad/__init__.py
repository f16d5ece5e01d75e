"""Every kind of bad input."""

from tests.bad.commands import COMMAND_LINES
from tests.bad.hostile import BOUNDS, DEEP, DRAWS, WORDS
from tests.bad.kind import Bad
from tests.bad.laws import LAWS
from tests.bad.models import GAITS, HUMAN, MODELS
from tests.bad.references import REFERENCES
from tests.bad.scenarios import BACKSTEPS, CHANGES, FILES, SENSES, STARTS_AND_TIMES, VARIATIONS

__all__ = ["HUMAN", "KINDS", "LAWS", "Bad"]

KINDS = (
    *FILES, *STARTS_AND_TIMES, *CHANGES, *BACKSTEPS, *SENSES, *VARIATIONS, *GAITS, *MODELS, *LAWS, *COMMAND_LINES,
    *REFERENCES,
    *BOUNDS, *DEEP, *DRAWS, *WORDS,
)  # fmt: skip
