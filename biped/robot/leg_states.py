"""The four leg states (Fig 3.3) as kernels and logs number them.

Index 0 … 3 is leg state 1 … 4 of the thesis; gains are given in this order, and a log holds the index plus one.
"""

from __future__ import annotations

STANCE, PUSH_OFF, SWING, EXTENDED = 0, 1, 2, 3
"""Heel on the ground; toe only; in the air; in the air with the knee extended and the thigh ahead."""
STATES = 4
FIRST_IN_AIR = SWING
"""From this index on a leg is in the air."""
