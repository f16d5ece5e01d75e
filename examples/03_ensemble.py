"""Many runs from different starts: how many walk, as a table with a row for each."""

import biped

ensemble = biped.run("demo/slope", duration=3.0, expect={}, **{"window.end": 3.0, "randomise.runs": 6})
print(f"{ensemble.summary['walked']} of {ensemble.runs.num_rows} walked")
print(ensemble.runs.select(["index", "seed", "speed", "peak_torque"]).to_pylist()[0])
