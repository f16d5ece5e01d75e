"""Ensembles that were made, kept in a file: an interrupted table goes on where it was, and nothing is made twice."""

from __future__ import annotations

import json
from collections.abc import Mapping
from hashlib import blake2b
from pathlib import Path
from typing import Any

import msgspec

from biped.base.errors import InputError
from biped.base.files import label
from biped.base.json import dumps
from biped.base.replacing import may_fill
from biped.base.typed import convert
from biped.base.writing import reason, write_text
from biped.ensemble.journal import origin_of
from biped.ensemble.plan import Plan
from biped.studies.standard.search import Tried

FILE = "measured.json"


class _Kept(msgspec.Struct):
    reached: int
    runs: int
    numbers: dict[str, float | None]


class StoredMeasurements:
    """Ensembles by what they were made of: scenario, model, gains, kernels, machine.

    Args:
        folder: Where they are kept; made if it does not exist.

    Raises:
        InputError: What is there is something else, or cannot be written.
    """

    def __init__(self, folder: Path):
        self._file = folder / FILE
        self._kept: dict[str, Any] = {}
        may_fill(folder, "--out", (FILE, "standard.json"))
        try:
            folder.mkdir(parents=True, exist_ok=True)
            if self._file.is_file():
                self._kept = json.loads(self._file.read_bytes())
                convert(self._kept, dict[str, _Kept])
        except OSError as error:
            raise InputError(f"--out {folder}: cannot be written: {reason(error)}; choose another folder") from None
        except (ValueError, RecursionError, msgspec.MsgspecError) as error:
            why = " ".join(str(error).split())[:200]
            raise InputError(f"{label(self._file)}: not what biped standard keeps: {why}; remove it") from None

    def get(self, plan: Plan, goal: str, value: float) -> Tried | None:
        """The ensemble of a plan, if it was made."""
        kept = self._kept.get(_key(plan, goal))
        return None if kept is None else Tried(value, kept["reached"], kept["runs"], kept["numbers"])

    def keep(self, plan: Plan, goal: str, tried: Tried) -> None:
        """Keeps the ensemble of a plan.

        Raises:
            InputError: It cannot be written.
        """
        self._kept[_key(plan, goal)] = {"reached": tried.reached, "runs": tried.runs, "numbers": dict(tried.numbers)}
        try:
            write_text(self._file, dumps(self._kept, indent=0))
        except OSError as error:
            raise InputError(f"{label(self._file)}: cannot be written: {reason(error)}") from None


def _key(plan: Plan, goal: str) -> str:
    origin: Mapping[str, str] = origin_of(plan)
    return blake2b(json.dumps([origin, goal], sort_keys=True).encode(), digest_size=12).hexdigest()
