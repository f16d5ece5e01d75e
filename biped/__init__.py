"""biped: does this walking controller really work?

A walking controller is put through level walking, pushes, slopes and randomised models in a simulator it was
never tuned in (MuJoCo) and in the one it comes from (the constrained dynamics of Braun, 2009).
"""

TYPE_CHECKING = False  # as type checkers know it: importing typing would take longer than all else here
if TYPE_CHECKING:
    from biped.api import Compared, Differed, Loaded, Result, check, compare, diff, load, run, sweep

__all__ = ["Compared", "Differed", "Loaded", "Result", "check", "compare", "diff", "load", "run", "sweep"]


def __getattr__(name: str) -> object:
    """Imports the Python interface when it is first used: `import biped` alone takes no time."""
    if name in __all__:
        from importlib import import_module

        return getattr(import_module("biped.api"), name)
    if name == "__version__":
        from biped.base import VERSION

        return VERSION
    raise AttributeError(f"module 'biped' has no attribute '{name}'")


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__, "__version__"])
