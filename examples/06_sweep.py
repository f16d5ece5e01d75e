"""A sweep: the same ensemble on several slopes."""

import biped

start = biped.load("demo/slope", duration=3.0, expect={}, **{"window.end": 3.0, "randomise.runs": 2})
for point in biped.sweep(start, {"ground.slope": [-3.0, 0.0, 3.0]}).points:
    print(f"{point['values']['ground.slope']:+.0f} degrees: {point['walked']} of {point['runs']} walked")
