"""Honest runs by number: of drawn masses, frictions, slopes and pushes, of every shipped scenario, and of policies."""

from __future__ import annotations

import random
from functools import cache
from pathlib import Path

from biped.base.files import names
from biped.studies.run import plan_of

Case = tuple[str, list[str], str, int]
"""Scenario, changes, group, number of the run."""
OF_EACH = 20
"""Runs of a shipped scenario, spread evenly over those that it has."""
CONVERGED = ["simulation.iterations=100", "simulation.ls_iterations=50"]
"""Model files of policies are often trained with five iterations of the line search: then the solver's forces do not
balance the weight by 5 %, which is doubted, and rightly."""

COMPILED = ("calm/own", "robust/own", "upright/own", "level_normal", "level_fast", "level_slow_generalized",
            "calm/home", "calm/stand", "robust/walk_to_stand", "calm/sit")  # fmt: skip
ANY = ("any/walker2d", "any/h1", "any/humanoid", "any/robot", "spatial/own")


def honest(number: int) -> Case:
    """A gait that walks, stands or sits, whose robot and surroundings are drawn."""
    r = random.Random(f"honest {number}")
    if r.random() < 0.05:
        name = r.choice(ANY)
        end = 2.5 if name == "spatial/own" else 1.5
        slope = f"ground.slope={r.uniform(-1, 1):.3g}"
        return name, [f"duration={end}", "window.start=0.4", f"window.end={end}", slope, "randomise.runs=1",
                      "push=[]", "randomise.draw={}", f"seed={r.randrange(10**6)}"], "any robot", 0  # fmt: skip
    name = r.choice(COMPILED)
    at_home = name.endswith("home")
    end = r.uniform(4.0, 8.0) if name in COMPILED[:7] else 12.0
    changes = [f"duration={end:.3f}", f"window.start={end - 2.5:.3f}", f"window.end={end:.3f}", "sweep={}",
               "randomise.runs=1", f"seed={r.randrange(10**6)}"]  # fmt: skip
    if r.random() < 0.7:
        changes.append(f"truth.mass={[round(r.uniform(0.85, 1.15), 4) for _ in range(7)]}")
    if r.random() < 0.7 and not at_home:
        changes.append(f"ground.friction={r.uniform(0.5, 1.5):.3g}")
    if r.random() < 0.5:
        changes.append(f"ground.slope={r.uniform(-4.0, 4.0):.3g}")
    if r.random() < 0.5:
        force = [round(r.uniform(-300.0, 300.0), 1), round(r.uniform(-50.0, 50.0), 1)]
        changes.append(f"push=[{{at={r.uniform(0.5, 3.0):.3f},duration={r.uniform(0.02, 0.2):.3f},force={force}}}]")
    return name, changes, "seven links", 0


def shipped(number: int) -> Case:
    """A run of a shipped scenario, as it is; the group is its folder.

    Raises:
        IndexError: There are not so many.
    """
    name, index = every_run()[number]
    return name, [], name.partition("/")[0] if "/" in name else "level ground", index


@cache
def every_run() -> tuple[tuple[str, int], ...]:
    """Scenario and number of the runs that `shipped` numbers: first the first of each scenario, then the second."""
    found = []
    for name in names("scenarios"):
        count = len(plan_of(name, []))
        few = min(count, OF_EACH)
        found += [(k, name, k * count // few) for k in range(few)]
    return tuple((name, index) for _, name, index in sorted(found))


def of_policy(number: int, scenarios: tuple[str, ...]) -> Case:
    """A policy that is commanded something, on ground and with a push that are drawn."""
    r, name = random.Random(f"policy {number}"), scenarios[number % len(scenarios)]
    force = [round(r.uniform(-40.0, 40.0), 1) for _ in range(3)]
    changes = [f"command.forward={r.uniform(0.0, 0.6):.3f}", f"ground.slope={r.uniform(-2.0, 2.0):.3g}",
               f"ground.friction={r.uniform(0.6, 1.2):.3g}", f"seed={r.randrange(10**6)}", "duration=8.0",
               f"push=[{{at={r.uniform(2.0, 5.0):.3f},duration=0.1,force={force}}}]"]  # fmt: skip
    return name, [*CONVERGED, *(changes if number >= len(scenarios) else [])], Path(name).stem, 0
