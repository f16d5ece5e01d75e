"""Trajectories of runs, and metrics of them."""
