"""Simulators behind one call: a run goes in, a trajectory comes out."""
