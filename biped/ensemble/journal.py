"""Finished work, line by line, for whatever is killed to go on from: what it says can be trusted, or is left out.

The first line says what the work is part of and what it was done with. Every other line is one record in JSON whose
last key, `sum`, is a digest of the line and of that head: a line that was cut, garbled, glued, altered or that belongs
to another journal does not match, is left out with a word, and its work is done again.
"""

import json
import re
from collections.abc import Iterator, Mapping
from hashlib import blake2b
from pathlib import Path
from typing import Any

from biped.base.errors import InputError
from biped.base.files import label
from biped.base.json import dumps, with_nan
from biped.base.writing import written

FORMAT = 1
_SUM = re.compile(rb', "sum": "([0-9a-f]{16})"}$')


class Journal:
    """A journal of records.

    Args:
        path: The file.
        about: What the records are part of and what they are made with; records of anything else are not continued.
    """

    def __init__(self, path: Path, about: Mapping[str, str]):
        self.path = path
        self.about = dict(about)
        self._head = dumps({"journal": FORMAT, **about}).encode()
        self._key = blake2b(self._head, digest_size=32).digest()

    def read(self) -> tuple[list[dict[str, Any]], list[str]]:
        """The records, in the order they were noted, and a word on each kind of line that had to be left out.

        The file then holds these records alone. A number that does not exist is nan.

        Raises:
            InputError: It is the journal of something else, or of an earlier version.
            OSError: It cannot be read or mended.
        """
        if not self.path.is_file():
            return [], []
        records, bad, older, headed, whole = [], [], 0, False, True
        for number, line, whole in self._lines():  # noqa: B007
            record = self._record(line)
            if record is not None:
                records.append(record)
                continue
            if line == self._head:
                headed = True
                continue
            other = _parsed(line)
            if not headed and not records and other is not None and "journal" in other:
                raise InputError(self._differs(other))
            older += other is not None and "index" in other and "sum" not in other
            bad.append(number)
        if older and not headed and not records:
            raise InputError(
                f"{label(self.path)}: begun by a version of biped that did not note what its runs were made with; they "
                "cannot be told to belong here: choose another folder, or remove the file to make all runs again"
            )
        if bad or not headed or not whole:
            with written(self.path) as part, open(part, "wb") as file:
                file.write(self._head + b"\n")
                for record in records:
                    file.write(self._line(record))
        if not bad:
            return records, []
        shown = ", ".join(map(str, bad[:5])) + (", …" if len(bad) > 5 else "")
        lines = f"line {shown} is" if len(bad) == 1 else f"{len(bad)} lines ({shown}) are"
        return records, [f"{label(self.path)}: {lines} damaged or from elsewhere: left out, and the work done again"]

    def note(self, record: Mapping[str, Any]) -> dict[str, Any]:
        """Adds a record; it is with the system when this returns, and survives the end of this process.

        Returns:
            The record as it will be read: what goes on from a journal must not tell it from what was never stopped.

        Raises:
            OSError: It cannot be written.
        """
        with open(self.path, "ab") as file:
            line = self._line(record)
            file.write(line if file.tell() else self._head + b"\n" + line)
        return with_nan(json.loads(dumps(record)))

    def _lines(self) -> Iterator[tuple[int, bytes, bool]]:
        """Lines, which end at a line feed and nowhere else: number, text without it, whether it is there."""
        with open(self.path, "rb") as file:
            for number, line in enumerate(file, 1):
                yield number, line.removesuffix(b"\n"), line.endswith(b"\n")

    def _line(self, record: Mapping[str, Any]) -> bytes:
        text = dumps(record).encode()
        return text[:-1] + b', "sum": "' + self._sum(text) + b'"}\n'

    def _sum(self, text: bytes) -> bytes:
        return blake2b(text, digest_size=8, key=self._key).hexdigest().encode()

    def _record(self, line: bytes) -> dict[str, Any] | None:
        """The record in a line of this journal; None for any other line."""
        found = _SUM.search(line)
        text = line[: found.start()] + b"}" if found else b""
        return with_nan(json.loads(text)) if found and self._sum(text) == found[1] else None

    def _differs(self, other: Mapping[str, Any]) -> str:
        here = {"journal": FORMAT, **self.about}
        names = [name for name in {**here, **other} if other.get(name) != here.get(name)]
        there, now = (", ".join(f"{name} {of.get(name, 'unknown')!s:.80}" for name in names) for of in (other, here))
        return (
            f"{label(self.path)}: its runs were made with {there}; here is {now}: runs of the two are not mixed; "
            "choose another folder, or remove the file to make all runs again"
        )


def _parsed(line: bytes) -> dict[str, Any] | None:
    """The object in a line, if it is one."""
    try:
        value = json.loads(line)
    except (ValueError, RecursionError):  # UnicodeDecodeError is a ValueError
        return None
    return value if isinstance(value, dict) else None
