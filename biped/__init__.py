"""biped: does this walking controller really work?

A walking controller is put through level walking, pushes, slopes and randomised models in a simulator it was
never tuned in (MuJoCo) and in the one it comes from (the constrained dynamics of Braun, 2009).
"""

__version__ = "0.1.0"
