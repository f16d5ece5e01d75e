"""Errors, files, texts, statistics, and how kernels are compiled."""

VERSION = "0.2.0"
"""Version of the package, here alone: pyproject.toml, `biped --version` and results take it from here."""
