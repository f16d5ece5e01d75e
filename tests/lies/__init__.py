"""Helped robots, dishonest runs and honest ones, by number: `python -m tests.lies` judges them all."""
