"""biped: does this walking controller really work?

A walking controller is put through level walking, pushes, slopes and randomised models in a simulator it was
never tuned in (MuJoCo) and in the one it comes from (the constrained dynamics of Braun, 2009).
"""

import os

from biped.base.kernels import place_cache

# 9x9 problems gain nothing from BLAS threads and lose milliseconds under load; must precede numpy's import.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
place_cache()

__version__ = "0.1.0"
