"""The trajectory of a run: arrays by name, one row per control tick."""

import biped

walk = biped.run("demo/robot", duration=2.0, push=[], expect={}, **{"window.end": 2.0}).trajectory
print(f"{len(walk)} ticks of {walk.tick * 1000:g} ms; torques in {walk.units['u']}")
print("largest torque of each joint:", abs(walk.u).max(axis=0).round(1))
