"""Chapter II as a library: constrained mechanical systems, integrated without drift and without iteration."""

from biped.dynamics.integrate import integrate
from biped.dynamics.schemes import EULER, RK4, RK8, Correction, Scheme
from biped.dynamics.system import ConstrainedSystem, Evaluation
from biped.dynamics.trajectory import Solution

__all__ = [
    "EULER",
    "RK4",
    "RK8",
    "ConstrainedSystem",
    "Correction",
    "Evaluation",
    "Scheme",
    "Solution",
    "integrate",
]
