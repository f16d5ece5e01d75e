"""Two results run by run: is the second worse than the first?"""

import biped

start = biped.load("demo/push", duration=3.0, push=[], expect={}, **{"window.end": 3.0, "randomise.runs": 4})
first, second = (biped.run(start, **{"ground.friction": friction}) for friction in (1.0, 0.6))
print(biped.diff(first, second, metrics=["walked", "speed", "peak_torque"]))
