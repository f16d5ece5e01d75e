"""Cost of a learned policy's closed loop, as a ratio to its bare steps of MuJoCo and its bare network calls."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import NamedTuple

import numpy as np

from biped.base.files import folder
from biped.control.network import Network
from biped.engines.mujoco import simulate
from biped.ensemble.campaign import simulate as one_of
from biped.ensemble.executor import mapped
from biped.ensemble.plan import Plan
from biped.scenario.card_file import read_card
from biped.scenario.reading import from_text
from biped.studies.bench.replay import Replay, clock, replay_of, replayed

SECONDS, REPEATS, RUNS, ROUNDS = 10.0, 3, 100, 10
SHIPPED = folder("controllers") / "policy" / "h1.toml"


class PolicyCost(NamedTuple):
    """Costs of one policy, in seconds of one core unless said otherwise.

    Attributes:
        seconds: [s] of a run.
        steps: Bare steps of the same run, from Python.
        network: Bare calls of the network, as often as the run asks it.
        loop: The run, logged at every step.
        sparse: The same, logged at the calls of the network alone; None where these are no ticks of that rate.
        one: [s] by the clock of many runs in one process, as the fastest round has it; None: not measured.
        two: The same in two.
        bare: What two processes take of the time of one for bare steps: what the machine itself allows; None: not
            measured.
        runs: How many runs these are.
    """

    seconds: float
    steps: float
    network: float
    loop: float
    sparse: float | None
    one: float | None
    two: float | None
    bare: float | None
    runs: int = RUNS

    def ratio(self, loop: float) -> float:
        """A loop's cost / that of steps and calls."""
        return loop / (self.steps + self.network)


def policy_cost(file: Path, quick: bool, repeats: int = REPEATS, seconds: float = SECONDS) -> PolicyCost:
    """Measures a policy; least times of interleaved repeats.

    Args:
        file: Its card.
        quick: Whether to leave out many runs.
        repeats: Of which the least times count.
        seconds: [s] of a run.

    Raises:
        InputError: Card, network and model do not fit one another.
    """
    card = read_card(file)
    run, sparse = _plan(file, seconds, "").run(0), None
    if (card.start * card.rate).is_integer():
        sparse = _plan(file, seconds, f"simulation = {{ control_rate = {card.rate} }}\n").run(0)
    network, replay = Network(file.parent / card.network), replay_of(run, simulate(run))
    observed, calls = np.zeros(network.size or 1, np.float32), round(seconds * card.rate)

    def ask() -> None:
        for _ in range(calls):
            network.ask(observed)

    parts = [lambda: replayed(replay), ask, *(partial(simulate, one) for one in (run, sparse) if one is not None)]
    steps, network_cost, loop, *few = np.min([[clock(part) for part in parts] for _ in range(repeats)], axis=0).tolist()
    one = two = bare = None
    if not quick:
        plan = _plan(file, seconds, f"start = {{ jitter = 0.002 }}\nrandomise = {{ runs = {RUNS} }}\n")
        works = [(work, jobs) for work in (partial(_end, plan), partial(_steps, replay)) for jobs in (1, 2)]
        # In turns, of which the least counts: of what else a machine does, two processes suffer more than one.
        rounds = [[_clocked(work, RUNS // ROUNDS, jobs) for work, jobs in works] for _ in range(ROUNDS)]
        one, two, alone, both = (ROUNDS * np.min(rounds, axis=0)).tolist()
        bare = both / alone
    return PolicyCost(seconds, steps, network_cost, loop, few[0] if few else None, one, two, bare)


def _clocked(work: Callable[[int], object], count: int, jobs: int) -> float:
    """[s] by the clock of a piece of work, again and again."""
    begun = perf_counter()
    mapped(work, list(range(count)), jobs)
    return perf_counter() - begun


def _steps(replay: Replay, index: int) -> None:
    """Bare steps of a run; whatever its number."""
    replayed(replay)


def _end(plan: Plan, index: int) -> str:
    return one_of(plan.run(index)).end


def _plan(file: Path, seconds: float, more: str) -> Plan:
    forward = 0.8 * min(0.5, read_card(file).command.get("forward", (0.0, 0.5))[1])
    text = f'law = "{file.name}"\nduration = {seconds}\ncommand = {{ forward = {forward} }}\n{more}'
    return Plan(from_text(text, file.parent / "bench.toml"))
