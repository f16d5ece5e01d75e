"""A check: what is expected, what was measured, and whether it holds."""

import biped

checked = biped.check("demo/push", duration=4.0, push=[], expect={"falls": {"max": 0}, "peak_torque": {"max": 160.0}})
for check in checked.checks:
    print(f"{check['name']}: {check['value']:.4g}, expected {check['expected']}")
assert checked.passed
