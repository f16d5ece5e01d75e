"""From what the user names to what is run."""

from collections.abc import Sequence
from pathlib import Path

from msgspec.structs import replace

from biped.base.files import canonical, locate
from biped.ensemble.plan import Plan
from biped.robot.law_factory import Factory
from biped.scenario.keys import Scenario
from biped.scenario.laws import digest
from biped.scenario.possible import possible
from biped.scenario.reading import read
from biped.scenario.valid import fault


def title_of(name: str) -> str:
    """A scenario's name for people and folders."""
    path = locate("scenarios", name, "scenario")
    known = canonical("scenarios", path)
    return path.stem if Path(known).suffix else known


def plan_of(name: str, changes: Sequence[str], law: Factory | None = None) -> Plan:
    """Reads and plans a scenario.

    Args:
        name: Name or path of the scenario.
        changes: `--set` changes.
        law: A control law handed over as an object; default: what the scenario says.

    Raises:
        InputError: Something in it, or in a file that it names, cannot be used.
    """
    scenario, origin = read(name, changes)
    if law is not None:
        with origin.naming():
            scenario = with_law(scenario, law)
    return Plan(scenario, origin, law=law)


def with_law(scenario: Scenario, law: Factory) -> Scenario:
    """The scenario with the name of a law that was handed over.

    Raises:
        InputError: It asks for what only the thesis's law does.
    """
    scenario = replace(scenario, law=law.name, law_sha256=digest(law.name) if law.file and ".py:" in law.name else None)
    possible(scenario, fault)
    return scenario
