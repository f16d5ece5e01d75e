"""The campaign of `conftest.folder`, run in any way."""

from __future__ import annotations

from biped.cli.main import main
from tests.cases import contents


def run(out: str, *more: str, code: int = 0) -> dict[str, bytes]:
    """Files that `biped run e.toml` leaves in a folder."""
    assert main(["run", "e.toml", "--out", out, *more]) == code
    return contents(out)


def of_results(files: dict[str, bytes]) -> dict[str, bytes]:
    """Of these files, those that say what a campaign came to."""
    return {name: data for name, data in files.items() if name.endswith((".json", ".parquet", ".toml"))}
