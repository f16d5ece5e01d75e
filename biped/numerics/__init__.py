"""Orthogonal factorisations and triangular solves that several rooms share."""
