"""A kind of bad input: what a user wrote, and what the answer must say about it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple


class Bad(NamedTuple):
    """One kind of bad input.

    Attributes:
        name: What is wrong.
        says: Fragments that the message must contain: file, key, expectation, nearest valid name.
        scenario: Text of s.toml.
        argv: Command line; default: run s.toml.
        files: More files, by path.
    """

    name: str
    says: tuple[str, ...]
    scenario: str = ""
    argv: tuple[str, ...] = ("run", "s.toml")
    files: Mapping[str, str | bytes] = {}
