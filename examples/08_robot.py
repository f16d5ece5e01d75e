"""A robot of any kind: Unitree's H1 stands through a push."""

import biped

result = biped.run("demo/h1", duration=2.0, push=[{"at": 0.5, "duration": 0.2, "force": [20.0, 0.0, 0.0]}])
print(f"stood: {result.summary['stood']} of 1; leaned {abs(result.trajectory.lean).max():.3f} rad at most")
