"""Gaits as limit cycles: return maps, fixed points, Floquet multipliers and what they are worth."""
