"""Rigid-body mechanics of the planar walker as the thesis writes it: constraints that hold exactly, or do not act."""
