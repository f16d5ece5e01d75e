"""A search of a few runs, which a test can afford."""

from __future__ import annotations

from biped.scenario.reading import read_scenario
from biped.studies.tune.evaluate import Study

TEXT = """
controller = "fast"
seed = 5
duration = 0.5

[start]
jitter = 0.002

[tune]
duration = 0.3
generations = 3
population = 4
recheck = 2
checks = 1
unseen = 2
finalists = 2

[tune.weights]
cost_of_transport = 0.1

[tune.conditions.level]
runs = 2
speed = 0.8

[tune.conditions.uphill]
runs = 1
set.ground.slope = 5.0
"""


def study_of(path, *changes):
    return Study(read_scenario(str(path), list(changes)))
