"""Where a scenario's keys were written, so that whatever is found wrong later still names the file."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from biped.base.errors import InputError
from biped.base.files import label

COMMAND_LINE = Path("--set")


class Origin(NamedTuple):
    """Where keys come from.

    Attributes:
        file: The scenario file; None if the scenario was not read from one.
        keys: File (or `COMMAND_LINE`) of each dotted key that somebody wrote.
    """

    file: Path | None = None
    keys: Mapping[str, Path] = {}

    def of(self, key: str) -> str:
        """The file (or --set) that a dotted key comes from; the scenario file if nobody wrote it."""
        asked = at = key.partition("[")[0].replace('"', "")
        while at:
            # Whoever wrote another key of a table did not write this one.
            if at in self.keys and (at == asked or not any(key.startswith(f"{at}.") for key in self.keys)):
                return label(self.keys[at])
            at = at.rpartition(".")[0]
        return "scenario" if self.file is None else label(self.file)

    def fault(self, key: str, what: str) -> InputError:
        """The error of a key: file, key, what is wrong."""
        return InputError(f"{self.of(key)}: {key}: {what}")

    @contextmanager
    def naming(self) -> Iterator[None]:
        """Names the file in complaints about a key that come up after the scenario was read."""
        try:
            yield
        except InputError as error:
            if error.key is None or self.file is None:
                raise
            raise InputError(f"{self.of(error.key)}: {error}") from error


UNKNOWN = Origin()
