"""Honest runs by number, from a seed: drawn masses, frictions, slopes, pushes of gaits that walk, stand or sit."""

from __future__ import annotations

import random

COMPILED = ("calm/own", "robust/own", "upright/own", "level_normal", "level_fast", "level_slow_generalized",
            "calm/home", "calm/stand", "robust/walk_to_stand", "calm/sit")  # fmt: skip
ANY = ("any/walker2d", "any/h1", "any/humanoid", "any/robot", "spatial/own")


def honest(number: int) -> tuple[str, list[str], str]:
    """Scenario, changes and kind of an honest run."""
    r = random.Random(f"honest {number}")
    if r.random() < 0.05:
        name = r.choice(ANY)
        end = 2.5 if name == "spatial/own" else 1.5
        slope = f"ground.slope={r.uniform(-1, 1):.3g}"
        return name, [f"duration={end}", "window.start=0.4", f"window.end={end}", slope, "randomise.runs=1",
                      "push=[]", "randomise.draw={}", f"seed={r.randrange(10**6)}"], "any"  # fmt: skip
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
    return name, changes, "compiled"
