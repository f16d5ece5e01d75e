"""Hostile input by the thousand: `make fuzz`, and a part of it among the default tests."""
