"""Functions of a system, compiled once or run as plain Python."""

import os
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from biped.base.errors import InputError
from biped.dynamics import integrate
from biped.dynamics.mechanisms import pendulum
from tests.dynamics.systems import START


def uncompilable(t, q, v, p, Q):
    Q[1] = -9.81 * (os.getpid() > 0)


def test_a_function_numba_cannot_compile_is_said_and_runs_as_python():
    system = replace(pendulum.pendulum(), force=uncompilable)
    with pytest.raises(InputError, match="the function force cannot be compiled"):
        integrate(system, **START)
    r = integrate(replace(system, compiled=False), **START)
    compiled = integrate(pendulum.pendulum(), **START)
    np.testing.assert_allclose(r.q, compiled.q, atol=1e-14)


def test_other_parameters_compile_nothing_again():
    system = pendulum.pendulum()
    other = system.with_params((1.0, 2.0, 9.81))
    assert all(a is b for a, b in zip(system.functions, other.functions, strict=True))
    r = integrate(other, [2.0, 0.0], [0.0, 0.0], duration=1.0, dt=1e-3)
    np.testing.assert_allclose(r.q, pendulum.exact(r.t, length=2.0), atol=1e-10)


SNIPPET = """
import numpy as np
from biped.dynamics import RK8, integrate
from biped.dynamics.mechanisms import four_bars as f
r = integrate(f.four_bars(), *f.CONSISTENT, duration=1.5, dt=1e-2, scheme=RK8)
print(r.steps, r.rank.max(), *r.q[-1])
"""


def test_the_kernels_run_as_plain_python_too():
    runs = [
        subprocess.run(
            [sys.executable, "-c", SNIPPET],
            env={**os.environ, "NUMBA_DISABLE_JIT": disable},
            capture_output=True,
            text=True,
            check=True,
        ).stdout.split()
        for disable in ("0", "1")
    ]
    assert runs[0][:2] == runs[1][:2]
    np.testing.assert_allclose(*np.array(runs)[:, 2:].astype(float), rtol=0, atol=1e-12)
