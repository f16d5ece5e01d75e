"""Mechanisms from bodies and joints, in the plane and in space: no derivative to write by hand."""

from biped.dynamics.bodies.mechanism import GROUND, Body, Joint
from biped.dynamics.bodies.plane import Plane
from biped.dynamics.bodies.space import Space

__all__ = ["GROUND", "Body", "Joint", "Plane", "Space"]
