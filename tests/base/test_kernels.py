"""Compiled kernels are never older than their sources, and importing biped leaves everything as it is."""

from __future__ import annotations

import ast
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

from biped.base import objects
from biped.base.kernels import ROOMS, digest

PACKAGE = Path(__file__).parents[2] / "biped"


def python(code: str, *argv: str, cwd: Path, **environment: str) -> subprocess.CompletedProcess:
    """Runs code in a process that knows nothing of this one's settings of numba and BLAS."""
    plain = {k: v for k, v in os.environ.items() if k not in ("NUMBA_CACHE_DIR", "OPENBLAS_NUM_THREADS")}
    return subprocess.run(
        [sys.executable, "-c", code, *argv],
        cwd=cwd,
        env=plain | environment,
        capture_output=True,
        text=True,
        check=True,
    )


def test_digest_changes_with_every_file_that_kernels_are_made_of_and_only_with_those(tmp_path):
    copy = tmp_path / "biped"
    shutil.copytree(PACKAGE, copy, ignore=shutil.ignore_patterns("__pycache__"))
    assert digest(copy) == digest(PACKAGE)
    seen = {digest(PACKAGE)}
    files = [path for room in ROOMS for path in (copy / room).rglob("*.py")]
    for path in files:
        path.write_text(path.read_text(encoding="utf-8") + "\n# changed\n", encoding="utf-8")
        seen.add(digest(copy))
    assert len(seen) == len(files) + 1
    for name in ("cli/main.py", "show/terminal.py", "scenario/keys.py", "studies/tune/search.py"):
        (copy / name).write_text("# changed\n", encoding="utf-8")
        assert digest(copy) in seen


def _room(parts):
    """The entry of ROOMS that a module or file belongs to, else its room."""
    return "/".join(parts[:2]) if "/".join(parts[:2]) in ROOMS else parts[0]


def test_kernels_take_in_nothing_from_rooms_that_the_digest_leaves_out():
    """A name that a kernel's file imports from biped, unless only other functions of the file use it."""
    found = 0
    for path in PACKAGE.rglob("*.py"):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        imported = {
            alias.asname or alias.name: _room(node.module.split(".")[1:])
            for node in tree.body
            if isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("biped.")
            for alias in node.names
        }
        kernels = [
            node for node in tree.body
            if isinstance(node, ast.FunctionDef) and any("kernel" in ast.unparse(d) for d in node.decorator_list)
        ]  # fmt: skip
        for function in kernels:
            found += 1
            assert _room(path.relative_to(PACKAGE).parts) in ROOMS
            for name in {node.id for node in ast.walk(function) if isinstance(node, ast.Name)}:
                assert imported.get(name, "base") in ROOMS, f"{path}: {function.name} takes in {name}"
    assert found > 50


SMALL = tuple(f"base/{name}.py" for name in ("__init__", "kernels", "jit", "compiler", "objects", "writing", "errors"))
CALLER = """from biped.base.jit import kernel
from biped.control.callee import f


@kernel
def g(x):
    return f(x)
"""
CALLEE = """from biped.base.jit import kernel
from biped.robot.number import FACTOR


@kernel
def f(x):
    return FACTOR * x
"""
CALL = "from biped.control.caller import g; print(g(1.0), sum(g.stats.cache_hits.values()))"


@pytest.fixture
def small(tmp_path) -> Path:
    """A package of biped's own cache and two kernels, one of which calls the other, with a number from a third file."""
    package = tmp_path / "here" / "biped"
    for room in ("base", "control", "robot"):
        (package / room).mkdir(parents=True)
        (package / room / "__init__.py").touch()
    for name in ("__init__.py", *SMALL):
        shutil.copy(PACKAGE / name, package / name)
    (package / "control" / "caller.py").write_text(CALLER, encoding="utf-8")
    (package / "control" / "callee.py").write_text(CALLEE, encoding="utf-8")
    (package / "robot" / "number.py").write_text("FACTOR = 2\n", encoding="utf-8")
    return package


def called(package: Path, **environment: str) -> tuple[list[str], str]:
    done = python(CALL, cwd=package.parent, PYTHONPATH=str(package.parent), **environment)
    return done.stdout.split(), done.stderr


def folders(package: Path) -> list[Path]:
    return sorted((package / "__pycache__").glob("kernels-*"))


def test_an_edited_number_in_another_file_is_compiled_again(small):
    said = []
    for factor in (2, 3):
        (small / "robot" / "number.py").write_text(f"FACTOR = {factor}\n", encoding="utf-8")
        said += [called(small)[0] for _ in range(2)]
    assert said == [["2.0", "0"], ["2.0", "1"], ["3.0", "0"], ["3.0", "1"]]


SHIPPED = "import sys; from biped.control.caller import g; print(g(1.0), 'numba' in sys.modules)"


@pytest.mark.skipif(not objects._is_of_baseline(), reason="kernels are shipped for another family of processors")
def test_shipped_kernels_are_loaded_without_numba_until_a_source_changes(small):
    caller = small / "control" / "caller.py"
    caller.write_text(CALLER.replace("kernel", "entry_kernel"), encoding="utf-8")

    def shown(**environment: str) -> list[str]:
        for folder in folders(small):
            shutil.rmtree(folder)
        return python(SHIPPED, cwd=small.parent, PYTHONPATH=str(small.parent), **environment).stdout.split()

    assert shown() == ["2.0", "True"]
    assert shown(BIPED_PORTABLE_KERNELS="1") == ["2.0", "True"]
    assert len(list((small / "compiled").rglob("*.o"))) == 1
    assert shown() == ["2.0", "False"]
    (small / "robot" / "number.py").write_text("FACTOR = 3\n", encoding="utf-8")
    assert shown() == ["3.0", "True"]


def _emptied(data: bytes) -> bytes:
    return b""


def _cut(data: bytes) -> bytes:
    return data[: len(data) // 2]


def _turned(data: bytes) -> bytes:
    middle = len(data) // 2
    return data[:middle] + bytes([data[middle] ^ 1]) + data[middle + 1 :]


@pytest.mark.parametrize("damage", [_emptied, _cut, _turned])
@pytest.mark.parametrize("suffix", ["nbi", "nbc"])
def test_a_damaged_cache_is_compiled_again_with_a_word(small, suffix, damage):
    called(small)
    files = [file for folder in folders(small) for file in folder.rglob(f"*.{suffix}")]
    assert files
    for file in files:
        file.write_bytes(damage(file.read_bytes()))
    (value, hits), said = called(small)
    assert (value, hits) == ("2.0", "0")
    assert said.count("are damaged: compiled again") == len(said.splitlines()) == 1
    assert called(small) == (["2.0", "1"], "")


def test_where_a_cache_cannot_be_written_kernels_run_all_the_same(small):
    called(small)
    for folder in folders(small):
        for file in folder.rglob("*.nbi"):
            file.unlink()
            file.mkdir()
    assert called(small)[0] == ["2.0", "0"]


def test_only_versions_that_nobody_used_for_a_week_are_removed(small):
    for factor in (2, 3):
        (small / "robot" / "number.py").write_text(f"FACTOR = {factor}\n", encoding="utf-8")
        called(small)
    assert len(folders(small)) == 2, "a process that still runs the other version may write there"
    old = time.time() - 8 * 24 * 3600
    for folder in folders(small):
        os.utime(folder / ".used", (old, old))
    (small / "robot" / "number.py").write_text("FACTOR = 4\n", encoding="utf-8")
    called(small)
    assert len(folders(small)) == 1


def test_installations_that_share_a_home_keep_their_kernels_apart(small, tmp_path):
    other = tmp_path / "there" / "biped"
    shutil.copytree(small, other)
    (other / "robot" / "number.py").write_text("FACTOR = 5\n", encoding="utf-8")
    home = tmp_path / "home"
    for package in (small, other):
        (package / "__pycache__").write_text("no folder can be made here", encoding="utf-8")
    for hits in "01":
        for package, product in ((small, "2.0"), (other, "5.0")):
            assert called(package, HOME=str(home), XDG_CACHE_HOME="") == ([product, hits], "")
    assert len(list((home / ".cache" / "biped").glob("*/kernels-*"))) == 2


def test_where_nothing_can_be_written_a_temporary_folder_serves_with_a_word(small, tmp_path):
    called(small)  # whoever installed it compiled it
    (kernels,) = folders(small)
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    (small / "__pycache__" / "none").touch()
    code = (
        "import sys, tempfile; from pathlib import Path; import biped.base.kernels as k\n"
        "k._usable = lambda folder: False\n" + CALL
    )
    for _ in range(2):
        done = python(code, cwd=small.parent, PYTHONPATH=str(small.parent), TMPDIR=str(temporary), HOME="/nowhere")
        assert done.stdout.split() == ["2.0", "1"], "taken from the installation, not compiled again"
        (line,) = done.stderr.splitlines()
        assert "compiled kernels are kept in" in line
    (folder,) = temporary.glob("biped-*/kernels-*")
    assert folder.name == kernels.name
    assert folder.parent.stat().st_mode & 0o077 == 0


def test_a_temporary_folder_that_others_can_write_to_is_not_trusted(small, tmp_path):
    code = (
        "import sys, tempfile; from pathlib import Path; import biped.base.kernels as k\n"
        "print(k._temporary(Path(k.__file__).parents[1]))"
    )
    call = {"cwd": small.parent, "PYTHONPATH": str(small.parent), "TMPDIR": str(tmp_path)}
    first = Path(python(code, **call).stdout.strip())
    assert Path(python(code, **call).stdout.strip()) == first
    first.chmod(0o777)
    assert Path(python(code, **call).stdout.strip()) != first


def test_numba_cache_dir_wins(small, tmp_path):
    assert called(small, NUMBA_CACHE_DIR=str(tmp_path / "mine"))[0] == ["2.0", "0"]
    assert not folders(small)
    assert list((tmp_path / "mine").rglob("*.nbc"))


def test_importing_biped_has_no_side_effects(tmp_path):
    """No files read but its own, nothing set, nothing written, no library imported; kernels leave numba's settings."""
    code = (
        "import os, sys; before = dict(os.environ), set(sys.modules)\n"
        "import biped\n"
        "assert dict(os.environ) == before[0]\n"
        "new = set(sys.modules) - before[1]\n"
        "assert new == {'biped'}, new\n"
        "from numba import config\n"
        "import biped.control.planar.tick\n"
        "assert dict(os.environ) == before[0] and config.CACHE_DIR == '', config.CACHE_DIR\n"
    )
    python(code, cwd=tmp_path, PYTHONPATH=str(PACKAGE.parent))


def test_commands_take_one_blas_thread_and_the_users_word_wins(tmp_path):
    code = "import os; from biped.cli.main import main; main(['list']); print(os.environ['OPENBLAS_NUM_THREADS'])"
    for said, expected in (({}, "1"), ({"OPENBLAS_NUM_THREADS": "3"}, "3")):
        done = python(code, cwd=tmp_path, PYTHONPATH=str(PACKAGE.parent), **said)
        assert done.stdout.splitlines()[-1] == expected


WALKS = """
import sys
import numpy as np
from biped.ensemble import campaign
from biped.studies.run import plan_of

ticks = int(sys.argv[2])
end = ticks * 1e-3
SHORT = [f"duration={end}", f"window.start={end / 3.0}", f"window.end={end}", "start.jitter=0.002"]
CASES = {
    "joint": [],
    "touching": ["actuation.contacts=touching", "actuation.single_tangential=true"],
    "generalized": ["actuation.mode=generalized"],
    "model error": ["randomise.controller_mass_matrix=0.1", "randomise.controller_constraints=0.1"],
    "model error at every tick": ["randomise.controller_mass_matrix=0.1", "randomise.controller_errors=tick"],
    "bounded": ["actuation.limit=bounded", "actuation.torque_limit=40.0"],
    "pyramid": ["simulation.cone=pyramidal", "ground.slope=3", "ground.friction=3.0"],
    "home": ["engine=home"],
    "home, dropped": ["engine=home", "start.settle=false", "actuation.mode=generalized"],
}
logs = {}
for name, changes in CASES.items():
    t = campaign.simulate(plan_of("level_normal", [*SHORT, *changes]).run(0))
    assert len(t) == ticks, (name, t.cause)
    logs[name] = t.log
np.savez(sys.argv[1], **logs)
"""


@pytest.mark.parametrize("ticks", [80, pytest.param(300, marks=pytest.mark.slow)])
def test_compiled_kernels_do_what_they_do_as_plain_python(tmp_path, ticks):
    """Control tick, rigid engine and geometry, each kind of run.

    Measured: equal to the last bit. A rounding error of one tick grows by an order of magnitude or two in 0.3 s.
    """
    import numpy as np

    logs = []
    for disable in "01":
        file = tmp_path / f"{disable}.npz"
        environment = os.environ | {"NUMBA_DISABLE_JIT": disable, "PYTHONPATH": str(PACKAGE.parent)}
        subprocess.run([sys.executable, "-c", WALKS, str(file), str(ticks)], env=environment, cwd=tmp_path, check=True)
        logs.append(dict(np.load(file)))
    assert len(logs[0]) == 9
    for name, log in logs[0].items():
        scale = np.abs(log).max(axis=0) + 1.0
        assert np.abs((logs[1][name] - log) / scale).max() < 1e-10, name
