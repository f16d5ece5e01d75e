"""Costs of a learned policy's loop, of a step in Drake and of a campaign, as ratios to the least that they could be.

A policy's are its bare steps of MuJoCo and its bare network calls. Drake's is MuJoCo's step at the same states of a
walk, in one process: both are called from Python and take the same generalized forces, and MuJoCo's is warm-started as
in the run. A campaign on a cluster on this machine stands beside processes here, by the clock.
"""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Callable
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from time import perf_counter
from typing import Any, NamedTuple

import mujoco
import numpy as np

from biped.base.errors import InputError
from biped.base.files import folder
from biped.control.network import Network
from biped.engines.drake import NEEDS
from biped.engines.mujoco import simulate
from biped.ensemble.backend import Jobs, Told
from biped.ensemble.campaign import cores, run_one
from biped.ensemble.campaign import simulate as one_of
from biped.ensemble.cluster import cluster_at
from biped.ensemble.executor import mapped
from biped.ensemble.plan import Plan
from biped.robot.run import Run
from biped.scenario.card import read_card
from biped.scenario.reading import from_text, read_scenario
from biped.studies.bench.replay import Replay, clock, replay_of, replayed
from biped.studies.run import plan_of, run

POLICY_SECONDS, POLICY_REPEATS, RUNS, ROUNDS = 10.0, 3, 100, 10
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


def policy_cost(file: Path, quick: bool, repeats: int = POLICY_REPEATS, seconds: float = POLICY_SECONDS) -> PolicyCost:
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


REPEATS = 15
ROBOTS = {"seven links": ("upright/own", False), "in space": ("spatial/own", True)}
"""Scenarios by what walks in them, and whether their engine sums work."""
SECONDS, STRIDE = 2.0, 3
"""[s] of a walk, and ticks between two states."""


class StepCost(NamedTuple):
    """Costs of a step at the states of a walk.

    Attributes:
        states: How many.
        mujoco: µs of `mj_step`.
        update: µs of Drake's own update, its state and forces set.
        step: µs of the engine's step: the update, contact forces and stops read, the work summed.
        memory: [MB] that the process grew by when Drake was imported and the plant built; nan where it is not known.
            Of the first robot alone: the import is part of it.
    """

    states: int
    mujoco: float
    update: float
    step: float
    memory: float

    def as_dict(self) -> dict[str, Any]:
        """Plain data, with the ratios to `mj_step`."""
        return self._asdict() | {"update_ratio": self.update / self.mujoco, "step_ratio": self.step / self.mujoco}


def step_costs(repeats: int = REPEATS, seconds: float = SECONDS) -> dict[str, StepCost]:
    """Measures each of `ROBOTS`; of each state the least time of interleaved repeats, which other work disturbs least.

    Args:
        repeats: Of each state.
        seconds: [s] of each walk.

    Raises:
        InputError: Drake is not installed.
    """
    if find_spec("pydrake") is None:
        raise InputError(NEEDS, "engine")
    changes = [f"duration={seconds}", f"window={{start=0.1, end={seconds}}}"]
    return {kind: step_cost(Plan(read_scenario(name, changes)).run(0), repeats, ledger)
            for kind, (name, ledger) in ROBOTS.items()}  # fmt: skip


def step_cost(run: Run, repeats: int = REPEATS, ledger: bool = True) -> StepCost:
    """Measures the steps of a walk on level ground; see `step_costs`."""
    states: list[tuple[np.ndarray, ...]] = []
    models: list[mujoco.MjModel] = []

    def watch(model: mujoco.MjModel, data: mujoco.MjData, _: np.ndarray) -> None:
        models[:] = [model]
        forces = data.qfrc_actuator + data.qfrc_applied
        states.append((data.qpos.copy(), data.qvel.copy(), forces, data.qacc_warmstart.copy()))

    simulate(run, watch)
    states, model = states[::STRIDE], models[0]
    data, before = mujoco.MjData(model), resident()
    from biped.engines.sap.stepper import Stepper

    stepper = Stepper(model, run.robot, True, run.scenario.model, ledger)
    stepper.step()
    memory = resident() - before
    context, plant, coordinates = stepper.context, stepper.plant, stepper.coordinates

    def foreign(q: np.ndarray, v: np.ndarray, forces: np.ndarray, warm: np.ndarray) -> Callable[[], object]:
        data.qpos[:], data.qvel[:], data.qfrc_applied[:], data.qacc_warmstart[:] = q, v, forces, warm
        return lambda: mujoco.mj_step(model, data)

    def update(q: np.ndarray, v: np.ndarray, forces: np.ndarray, _: np.ndarray) -> Callable[[], object]:
        context.SetDiscreteState(coordinates.state(q, v))
        stepper.act(coordinates.forces(forces))
        return lambda: plant.EvalUniquePeriodicDiscreteUpdate(context)

    def engine(q: np.ndarray, v: np.ndarray, forces: np.ndarray, _: np.ndarray) -> Callable[[], object]:
        stepper.q[:], stepper.v[:], stepper.applied[:] = q, v, forces
        return stepper.step

    least = np.full((3, len(states)), np.inf)
    for _ in range(repeats):
        for row, begin in zip(least, (foreign, update, engine), strict=True):
            for i, state in enumerate(states):
                call = begin(*state)
                start = perf_counter()
                call()
                row[i] = min(row[i], perf_counter() - start)
    mujoco_step, drake_update, drake_step = (1e6 * least.mean(axis=1)).tolist()
    return StepCost(len(states), mujoco_step, drake_update, drake_step, memory)


def resident() -> float:
    """[MB] of memory that the process holds; nan where the system does not say."""
    try:
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    except OSError:
        return float("nan")
    import resource

    return pages * resource.getpagesize() / 1e6


SCENARIO = "robust/own"
CAMPAIGNS = ((100_000, 0.2), (20_000, 10.0))
"""Runs, and their duration [s]."""
QUICK = ((12_000, 0.2), (200, 10.0))


class CampaignCost(NamedTuple):
    """One campaign, carried out twice.

    Attributes:
        runs: How many.
        duration: [s] of each.
        here: [s] by the clock with processes here.
        cluster: [s] with `local:N`, from the call on: scheduler and workers are started within it.
        work: [s] of CPU of the processes that made the runs here, over their number.
        parent: [ms] of CPU a run of the process that commits rows, with processes here.
        same: Whether both made the same bytes.
    """

    runs: int
    duration: float
    here: float
    cluster: float
    work: float
    parent: float
    same: bool

    def as_dict(self) -> dict[str, Any]:
        """Plain data, as `--json` prints it."""
        return self._asdict() | {"cluster_to_here": self.cluster / self.here, "here_to_work": self.here / self.work}


def campaign_costs(quick: bool, tell: Told) -> list[CampaignCost]:
    """Carries out every campaign here and on a cluster of as many workers.

    Args:
        quick: Whether to make fewer runs.
        tell: Told what begins.

    Returns:
        What they cost; meaningful on a machine that does nothing else.
    """
    return [_cost(runs, duration, tell) for runs, duration in (QUICK if quick else CAMPAIGNS)]


def _cost(runs: int, duration: float, tell: Told) -> CampaignCost:
    count = cores()
    changes = ["sweep={}", f"randomise.runs={runs}", f"duration={duration}", "start.jitter=0.002", "expect={}"]
    if duration < 5.0:
        changes.append(f"window.start={duration / 2}")
    run_one(plan_of(SCENARIO, changes), 0)  # compiled code is that of earlier runs, and is loaded
    with tempfile.TemporaryDirectory(prefix="biped-") as scratch:
        here, there = Path(scratch) / "here", Path(scratch) / "there"
        tell(f"{runs} runs of {duration:g} s: {count} processes here")
        before = os.times()
        first = _timed(changes, count, here)
        after = os.times()
        own = after.user + after.system - before.user - before.system
        children = after.children_user + after.children_system - before.children_user - before.children_system
        tell(f"{runs} runs of {duration:g} s: local:{count}")
        began = time.perf_counter()
        with cluster_at(f"local:{count}", False, tell) as cluster:
            _timed(changes, cluster, there)
        second = time.perf_counter() - began
        same = _rows(here) == _rows(there)
        return CampaignCost(runs, duration, first, second, children / count, 1e3 * own / runs, same)


def _timed(changes: list[str], jobs: Jobs, out: Path) -> float:
    began = time.perf_counter()
    run(SCENARIO, changes, jobs, out)
    return time.perf_counter() - began


def _rows(folder: Path) -> list[bytes]:
    rows = folder / "runs.parquet"
    return [path.read_bytes() for path in (folder / "result.json", *([rows] if rows.is_file() else _parts(folder)))]


def _parts(folder: Path) -> list[Path]:
    return sorted(folder.glob("parts/*.parquet"))
