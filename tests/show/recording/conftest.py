"""A run that is pushed on a slope, and its recording."""

import pytest

from biped.show.recording import record
from tests.show.recordings import CHANGES, recorded


@pytest.fixture(scope="package")
def run():
    return recorded("up hill/push", CHANGES)  # a name that an entity path has to escape


@pytest.fixture(scope="package")
def path(run, tmp_path_factory):
    path = tmp_path_factory.mktemp("recording") / "run.rrd"
    record(path, [run], title="a push on a slope")
    return path
