"""A share of a campaign: any set of shares, made anywhere in any order, is one campaign."""

from __future__ import annotations

import re
from typing import NamedTuple

from biped.base.errors import InputError
from biped.base.text import said


class Shard(NamedTuple):
    """Share `number` of `of`, counted from 1."""

    number: int
    of: int

    def runs(self, total: int) -> range:
        """Numbers of its runs, of so many: consecutive ones."""
        return range((self.number - 1) * total // self.of, self.number * total // self.of)

    def __str__(self) -> str:
        return f"{self.number}/{self.of}"


def shard_of(text: str) -> Shard:
    """What stands after `--shard`.

    Raises:
        InputError: It is no share.
    """
    found = re.fullmatch(r"(\d{1,7})/(\d{1,7})", text, re.ASCII)
    if found is None or not 1 <= int(found[1]) <= int(found[2]):
        raise InputError(f"--shard {said(text)}: expected I/N with 1 <= I <= N, such as 3/40")
    return Shard(int(found[1]), int(found[2]))
