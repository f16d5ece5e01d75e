"""The engines that a scenario can name: the one list of them, which everything else asks."""

from typing import NamedTuple

from biped.base.errors import InputError, safe

MUJOCO, HOME, DRAKE = "mujoco", "home", "drake"


class Engine(NamedTuple):
    """An engine.

    Attributes:
        place: Module with `simulate(run) -> Trajectory`, imported where it is used.
        meaning: In one line.
        any_robot: Whether it moves robots of any kind, or only seven links in a plane.
        rigid: Whether its contacts give way to nothing.
        own_clock: Whether its contacts need two of its steps within `ground.contact_time`.
        seat: Whether a biped can sit in it.
        uniform: Why its contacts are the same wherever they are; empty: they can differ.
        approximations: Values of `simulation.approximation` that it takes; the first is the default.
        library: Name of the package that it needs besides biped's own, on whose version its last digits depend.
    """

    place: str
    meaning: str
    any_robot: bool = True
    rigid: bool = False
    own_clock: bool = False
    seat: bool = False
    uniform: str = ""
    approximations: tuple[str, ...] = ("sap",)
    library: str = ""


ENGINES: dict[str, Engine] = {
    MUJOCO: Engine("biped.engines.mujoco", "MuJoCo's compliant contacts", own_clock=True, seat=True),
    HOME: Engine("biped.engines.home", "the thesis's own rigid contacts", any_robot=False, rigid=True,
                 uniform="contacts are rigid, with friction without limit"),
    DRAKE: Engine("biped.engines.drake", "Drake's compliant contacts (SAP), which no gait here was searched in",
                  uniform="friction and stiffness belong to bodies, not to places", approximations=("sap", "lagged"),
                  library="drake"),
}  # fmt: skip


def engines_named(text: str) -> list[str]:
    """Reads names of engines with commas between them, of the option `--engines`.

    Raises:
        InputError: One is unknown, or named twice.
    """
    names = text.split(",")
    if not set(names) <= set(ENGINES) or len(set(names)) < len(names):
        raise InputError(
            f"--engines: expected different ones of {', '.join(ENGINES)}, with commas between them; got '{safe(text)}'"
        )
    return names
