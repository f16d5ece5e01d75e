import numpy as np
import pytest

from biped.dynamics import RK8, integrate
from biped.dynamics.mechanisms import four_bars


@pytest.fixture(scope="session")
def four_bars_reference():
    """x₃ of the two four-bars at multiples of 1e-3 s up to 100 s, from their single angle; 1e-12 accurate."""
    r = integrate(four_bars.trusted(), [np.pi / 2], [-1.0], duration=100.0, dt=1e-3, scheme=RK8)
    return 2.0 + np.cos(r.q[:, 0])
