"""Who is tested or compared: a gait, or a law for any robot by its name, its class or its policy's card."""

from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import NamedTuple

from biped.base.errors import InputError, safe
from biped.base.files import canonical, is_file, locate, read_toml
from biped.base.trust import grant
from biped.scenario.gains import Gains
from biped.scenario.gait import read_gains, speeds_of
from biped.scenario.general import is_free, read_by
from biped.scenario.laws import BUILT_IN, THESIS, is_card, named_now
from biped.scenario.reading import read_scenario
from biped.scenario.vary import setting
from biped.studies.run import plan_of

PLAIN = "standard/level"
"""The test that any robot can be put to."""
_POSTURE = "start.posture"


class Entrant(NamedTuple):
    """A gait or a law.

    Attributes:
        name: For people.
        word: A gait's name or path; what `law` is in a scenario.
        law: Whether it is a law.
        model: Of a policy's card, the model file that it says; empty: it says none.
    """

    name: str
    word: str
    law: bool
    model: str = ""

    def speeds(self) -> tuple[float, float] | None:
        """The range of speeds [m/s] of a family of gaits; None of another."""
        return None if self.law else speeds_of(locate("controllers", self.word, "GAIT"))

    def in_space(self, changes: Sequence[str]) -> bool:
        """Whether it moves a robot in space, under `--set` changes."""
        return _in_space(self, tuple(changes))

    def moves_freely(self, test: str, changes: Sequence[str]) -> bool:
        """Whether the robot of a test has a free base; arguments as of `all_changes`."""
        return is_free(locate("models", read_scenario(test, self.all_changes(test, changes)).model, "model"))

    def all_changes(self, test: str, changes: Sequence[str]) -> list[str]:
        """All `--set` changes of a test with this in the place of its gait.

        Args:
            test: The test's scenario.
            changes: Those of the command line.
        """
        if not self.law:
            begun = read_scenario(test, changes)
            reads = "controller" in read_by(begun.law)[""]  # others walk without a gait
            return [*changes, *([setting("controller", self.word)] if reads else [])]
        begun = read_scenario(test)
        draws = {key: {name: getattr(draw, name) for name in draw.__struct_fields__ if getattr(draw, name) is not None}
                 for key, draw in begun.randomise.draw.items() if key != _POSTURE}  # fmt: skip
        start = [setting(f"start.{key}", getattr(begun.start, key)) for key in ("jitter", "upright")]
        out = [setting("law", self.word), 'controller=""', "start={}", *start,
               "randomise.draw={}", setting("randomise.draw", draws)]  # fmt: skip
        if self.model:
            out.append(setting("model", self.model))
        return [*out, *changes]


def entrant_of(word: str) -> Entrant:
    """The gait or the law of a name or path; a law that is a file may run, because it is named here.

    Raises:
        InputError: There is none.
    """
    if any(mark in word for mark in "\"'\\\n"):
        raise InputError(f"{safe(word)}: a gait's name or path with quotes cannot be used here")
    if named_now(word) == THESIS:
        raise InputError(f"{word}: expected a gait, by which this law walks: its name or path, such as normal")
    if word in BUILT_IN:
        return Entrant(word, word, law=True)
    file, colon, name = word.rpartition(":")
    if colon and file.endswith(".py"):
        path = Path(file).resolve()
        grant(path)
        return Entrant(name, f"{path}:{name}", law=True)
    path = Path(word).resolve()
    if is_card(word) and is_file(path) and "network" in (card := read_toml(path)):
        grant(path)
        scenario = card.get("scenario")
        model = str(scenario.get("model", "")) if isinstance(scenario, dict) else ""
        beside = path.parent / model
        return Entrant(path.stem, str(path), law=True, model=str(beside) if is_file(beside) else model)
    path = locate("controllers", word, "GAIT")
    known = canonical("controllers", path)
    return Entrant(path.stem if Path(known).suffix else known, word, law=False)


@cache
def _in_space(entrant: Entrant, changes: tuple[str, ...]) -> bool:
    if entrant.law:
        return not plan_of(PLAIN, entrant.all_changes(PLAIN, changes)).robot.planar
    return read_gains(locate("controllers", entrant.word, "GAIT"), Gains()).frontal is not None
