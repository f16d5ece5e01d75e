"""One run: a walker is pushed, and its numbers are read."""

import biped

result = biped.run("demo/push", duration=6.0, **{"window.end": 6.0})
print(result)
print(f"speed {result.summary['speed']:.2f} m/s, largest torque {result.summary['peak_torque']:.0f} N m")
