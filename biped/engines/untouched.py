"""A watch on a law that runs in the simulator's own process: it returns an action, and reaches for nothing else.

Nothing in Python forbids a law to change the simulator behind its observation: to have forces act at joints beyond
what their motors can, to move joints, to change what the model is made of. What holds the whole from outside shows in
its momentum (`biped.measure.momentum`); this finds what acts inside, too. It looks at ticks that no law can know, one
in `EVERY`, at the state, and at one look in `RARELY` and at the end of the run at the model's constants.
"""

import random
from collections import Counter

import mujoco
import numpy as np

from biped.measure.verdict import CHANGED

EVERY, RARELY = 8, 32
_STATE = int(mujoco.mjtState.mjSTATE_FULLPHYSICS | mujoco.mjtState.mjSTATE_USER)
"""All that a step starts from, but the solver's first guess."""
_SEEN_ONLY = ("mesh_", "tex_", "mat_", "skin_", "cam_", "light_", "name", "text_", "bvh_", "oct_")
"""How arrays of a model begin that no step reads by themselves."""
_LAID = ("geom_pos", "geom_quat")
"""Arrays that the engine itself changes where the ground is not level."""


class Untouched:
    """A list of what a law has changed in the simulator.

    Args:
        model: What is stepped.
        data: Its state.
        level: Whether the ground is: otherwise its planes are moved, as they should be.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, level: bool):
        self._model, self._data = model, data
        names = [name for name in dir(model) if not name.startswith(("_", *_SEEN_ONLY))]
        arrays = {name: value for name in names if isinstance(value := getattr(model, name), np.ndarray) and value.size}
        self._arrays = {name: (array, array.tobytes()) for name, array in arrays.items() if level or name not in _LAID}
        self._options = {name: self._option(name) for name in dir(model.opt) if not name.startswith("_")}
        self._state, self._parts = np.empty(mujoco.mj_stateSize(model, _STATE)), _parts(model)
        self._changed: Counter[str] = Counter()
        self._chance, self._next = random.Random(), 0

    def before(self, k: int) -> bool:
        """Returns whether to look at what the law does at tick k, which it is about to begin."""
        if k < self._next:
            return False
        self._next = k + 1 + self._chance.randrange(2 * EVERY - 1)
        mujoco.mj_getState(self._model, self._data, self._state, _STATE)
        return True

    def after(self) -> None:
        """Looks at what it did."""
        was = self._state.copy()
        mujoco.mj_getState(self._model, self._data, self._state, _STATE)
        if self._state.tobytes() != was.tobytes():
            parts, now = self._parts.items(), self._state
            self._changed.update(name for name, part in parts if now[part].tobytes() != was[part].tobytes())
        if self._chance.randrange(RARELY) == 0:
            self._changed.update(self._constants())

    def found(self) -> dict[str, int]:
        """Returns in how many looks each thing was found to be changed, at the end of a run."""
        self._changed.update(self._constants())
        return {CHANGED + name: count for name, count in sorted(self._changed.items())}

    def _constants(self) -> list[str]:
        arrays = [name for name, (array, was) in self._arrays.items() if array.tobytes() != was]
        return arrays + [f"option {name}" for name, was in self._options.items() if self._option(name) != was]

    def _option(self, name: str) -> bytes:
        return np.array(getattr(self._model.opt, name)).tobytes()


def _parts(model: mujoco.MjModel) -> dict[str, slice]:
    """Names of the parts of a state, and where each is in it: MuJoCo puts them in the order of their bits."""
    kinds = mujoco.mjtState
    bits = {int(getattr(kinds, name)): name for name in dir(kinds) if name.startswith("mjSTATE_")}
    out, first = {}, 0
    for bit in sorted(bit for bit in bits if bit & _STATE and bit.bit_count() == 1):
        size = mujoco.mj_stateSize(model, bit)
        out[bits[bit].removeprefix("mjSTATE_").lower()] = slice(first, first + size)
        first += size
    return out
