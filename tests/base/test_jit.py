"""Kernels within kernels."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from biped.base.jit import COMPILED, inner_kernel, kernel, numba


def _summed(a):
    s = 0.0
    for x in a:
        s += x
    return s


_within = inner_kernel(_summed)


@kernel
def _containing(a, b):
    return _within(a) - _within(b)


def test_an_inner_kernel_is_called_like_any_other():
    a, b = np.arange(4.0), np.ones(3)
    assert _containing(a, b) == 3.0
    assert _within(a) == 6.0


@pytest.mark.skipif(not COMPILED, reason="nothing is compiled")
@pytest.mark.parametrize(("made", "always"), [(kernel, False), (inner_kernel, True)])
def test_only_inner_kernels_always_become_part_of_what_calls_them(made, always):
    compiled = numba().njit(**made(_summed)._options | {"cache": False})(_summed)
    compiled(np.ones(2))
    (code,) = compiled.inspect_llvm().values()
    assert ("alwaysinline" in code) == always


NAMES = """
import sys
import numpy as np
from biped.base.jit import numba

for size in sys.argv[1:]:
    kind = numba().typeof(np.zeros(1, np.dtype([("a", "f8", int(size))]))).dtype
    print(size, kind.mangling_args[1][0])
"""


def test_code_for_a_record_is_named_after_what_is_in_it():
    """Of two records that two processes meet first, a third process would else take the one's code for the other's."""

    def names(*sizes: str) -> dict[str, str]:
        done = subprocess.run([sys.executable, "-c", NAMES, *sizes], capture_output=True, text=True, check=True)
        return dict(line.split() for line in done.stdout.splitlines())

    one, other = names("3", "5"), names("5", "3")
    assert one == other
    assert one["3"] != one["5"]
