"""Kernels that are loaded as object code do what they do when numba compiles them, and whatever is amiss is numba's."""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
from pathlib import Path
from threading import Thread
from typing import NamedTuple

import numpy as np
import pytest

from biped.base import objects
from biped.base.jit import SETTINGS, Kernel, begun, entry_kernel, kernel, long_kernel
from biped.base.kernels import sealed, unsealed

pytestmark = pytest.mark.skipif(SETTINGS, reason="numba has been told how to compile")

PACKAGE = Path(__file__).parents[2]
RECORD = np.dtype([("length", float), ("place", float, (2, 3)), ("on", np.int64)])


class Pair(NamedTuple):
    """Of everything that is handed over."""

    array: np.ndarray
    factor: float
    rest: tuple[bool, int, tuple[np.ndarray, ...]]


def _everything(record, pair, transposed, count, on):
    w = record[0]
    total = math.sin(pair.factor) * w["length"] + count
    for i in range(pair.array.shape[0]):
        total += pair.array[i] * 3.0**i
    for i in range(transposed.shape[0]):
        for j in range(transposed.shape[1]):
            w["place"][i, j] += transposed[i, j] + pair.rest[2][0][j]
    if on and pair.rest[0]:
        w["on"] += pair.rest[1]
    return total, count + w["on"], pair.rest[0]


everything = entry_kernel(_everything)
half_of = kernel(lambda x: 0.5 * x)


@entry_kernel
def number(x):
    """A number."""
    return half_of(x)


@long_kernel
def nothing(x):
    """Nothing, after writing to an array."""
    x[0] = math.tan(x[1])


@entry_kernel
def an_array(x):
    """What is not handed over."""
    return x


NAME = f"{__name__}.number"


def arguments(strided: bool = False):
    record = np.zeros(1, RECORD)
    record["length"], record["on"] = 0.7, 3
    array = np.arange(8.0)[:: 2 if strided else 1]
    pair = Pair(array, 0.3, (True, 2, (np.array([1.0, 2.0, 4.0]),)))
    return record, pair, np.arange(6.0).reshape(3, 2).T, -7, True


@pytest.fixture
def own_folder(tmp_path, monkeypatch):
    """Objects of this test alone; kernels forget theirs."""
    monkeypatch.setattr(objects, "cache_folder", lambda: tmp_path)
    for known in (everything, number, nothing, an_array):
        monkeypatch.setattr(known, "_codes", {})
    return tmp_path / "objects"


@pytest.mark.parametrize("strided", [False, True])
def test_everything_that_is_handed_over_arrives(own_folder, strided):
    ours, plain = arguments(strided), arguments(strided)
    assert everything(*ours) == _everything(*plain)
    assert ours[0].tobytes() == plain[0].tobytes()
    assert everything._codes[objects.kinds(ours)].__name__ == "call", "as object code, in the first process too"
    assert [f.suffix for f in own_folder.iterdir()] == [".o"]


def test_what_is_handed_over_once_is_what_is_handed_over_every_time(own_folder):
    ours, plain = arguments(), arguments()
    call = begun(everything, *ours[:3])
    for scalars in ((-7, True), (2, False), (5, True)):
        assert call(*scalars) == _everything(*plain[:3], *scalars)
    assert ours[0].tobytes() == plain[0].tobytes()
    assert begun(half_of, 3.0)() == 1.5, "a kernel that is not loaded"


def test_results_of_every_kind(own_folder):
    assert number(3.0) == 1.5
    assert number(np.float64(5.0)) == 2.5
    assert number(3) == 1.5
    x = np.array([0.0, 0.5])
    assert nothing(x) is None
    assert x[0] == math.tan(0.5)
    assert len(list(own_folder.iterdir())) == 4, "a file for each kind of arguments"


def test_code_is_made_for_a_kind_and_not_for_a_size():
    kinds = [objects.kinds(np.zeros(shape)) for shape in ((1, 9), (5, 9), (0, 9), (9, 1))]
    assert len(set(kinds)) == 1
    other = [np.zeros((3, 9)).T, np.zeros((3, 9))[:, ::2], np.zeros((3, 9), int), np.zeros(3), np.zeros((3, 9), ">f8")]
    frozen = np.zeros((3, 9))
    frozen.flags.writeable = False
    assert len({kinds[0], *map(objects.kinds, [*other, frozen])}) == 7
    assert objects.kinds(True) != objects.kinds(1) != objects.kinds(1.0)


def test_what_is_not_known_is_left_to_numba(own_folder):
    x = np.arange(3.0)
    assert an_array(x) is not None
    assert an_array(x).tolist() == x.tolist()
    assert number(np.int64(3)) == 1.5
    assert not own_folder.exists()


def test_code_for_another_machine_is_another_file(own_folder, monkeypatch):
    here = objects.file_of(NAME, (1.0,))
    monkeypatch.setattr(objects, "_machine", lambda: "another")
    assert objects.file_of(NAME, (1.0,)) != here


def _cut(file):
    file.write_bytes(file.read_bytes()[:-100])


def _turn(file):
    code = bytearray(file.read_bytes())
    code[-50] ^= 1
    file.write_bytes(code)


def _empty(file):
    file.write_bytes(b"")


def _elsewhere(file):
    head, _, code = (unsealed(file.read_bytes()) or b"").partition(b"\n")
    said = json.loads(head) | {"calls": ["a_function_that_nobody_has"]}
    file.write_bytes(sealed(json.dumps(said).encode() + b"\n" + code))


def _turn_head(file):
    code = bytearray(file.read_bytes())
    code[40] ^= 1
    file.write_bytes(code)


@pytest.mark.parametrize("damage", [_cut, _turn, _turn_head, _empty, _elsewhere])
def test_a_damaged_file_is_not_used_but_made_again(own_folder, damage):
    number(1.0)
    (file,) = own_folder.iterdir()
    whole = file.read_bytes()
    damage(file)
    assert objects.load(NAME, (1.0,), False) is None
    number._codes.clear()
    assert number(3.0) == 1.5
    assert file.read_bytes() == whole


def test_a_folder_that_cannot_be_written_to_costs_only_time(own_folder, monkeypatch):
    own_folder.write_text("no folder", encoding="utf-8")
    assert number(3.0) == 1.5


def test_threads_that_call_a_kernel_for_the_first_time_all_get_it(own_folder):
    found = []
    threads = [Thread(target=lambda k=k: found.append(number(2.0 * k))) for k in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(found) == list(range(8))


def test_processes_that_compile_a_kernel_at_the_same_time_keep_their_code_apart(tmp_path, monkeypatch):
    """Each has read the index before the other wrote it: neither's file is the other's, whoever writes the index."""
    from numba.core import config

    monkeypatch.setattr(config, "CACHE_DIR", str(tmp_path))
    for argument in (1.0, 1):
        apart = Kernel(number.py_func, number._options, False)
        monkeypatch.setattr(apart.value._cache._cache_file, "_load_index", dict)
        apart(argument)
    assert len(list(tmp_path.rglob("*.number-*.nbc"))) == 2


def test_processes_that_write_a_kernel_at_the_same_time_have_files_of_their_own(own_folder, monkeypatch):
    """Half of what one has written never gets the other's name."""
    names, write_bytes = [], Path.write_bytes
    monkeypatch.setattr(Path, "write_bytes", lambda self, data: names.append(self.name) or write_bytes(self, data))
    for _ in range(2):
        number(1.0)
        number._codes.clear()
        (file,) = own_folder.iterdir()
        file.unlink()
    assert len(set(names)) == 2
    assert all(name.startswith(".") for name in names)


def test_a_kernel_is_handed_to_other_processes_by_name():
    import pickle

    assert pickle.loads(pickle.dumps(number)) is number
    assert isinstance(number, Kernel)


RUN = """
import contextlib, io, json, sys
from biped.cli.main import main
out = io.StringIO()
with contextlib.redirect_stdout(out):
    main(["run", "level_normal", "--json", "--set", "duration=1.0", "--set", "window.start=0.5", "--set",
          "window.end=1.0", "--out", sys.argv[1]])
loaded = [name for name in ("numba", "pinocchio") if name in sys.modules]
print(json.dumps([loaded, json.loads(out.getvalue())["runs"]]))
"""


def test_a_run_is_the_same_to_the_last_bit_and_imports_neither_numba_nor_pinocchio(tmp_path):
    said = []
    for name, settings in (("first", {}), ("kept", {}), ("numba's", {"NUMBA_CACHE_DIR": ""})):
        done = subprocess.run(
            [sys.executable, "-c", RUN, str(tmp_path / name)],
            cwd=tmp_path, env=os.environ | {"PYTHONPATH": str(PACKAGE)} | settings, capture_output=True, text=True,
            check=True,
        )  # fmt: skip
        said.append(json.loads(done.stdout))
    assert [loaded for loaded, _ in said[1:]] == [[], ["numba"]]
    assert said[0][1] == said[1][1] == said[2][1]
