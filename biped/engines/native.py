"""MuJoCo's step called from compiled code by its address, where everything that this takes for granted holds.

The address of `mj_step` and those of model and data are arguments of compiled loops, never constants in them: what is
compiled can be kept on disk. The forces of constraints move in MuJoCo's arena at every step; where mjData keeps their
address and number is known by offset, and checked against what MuJoCo's bindings say. Nothing here is needed for a
right result: where anything does not hold, `reason` says what, and the engine steps from Python.
"""

import ctypes
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple
from weakref import WeakKeyDictionary

import mujoco
import numpy as np

from biped.base.jit import COMPILED
from biped.robot.planar.order import Order
from biped.robot.planar.topology import KNEE, N_ROWS, Z

FIELDS = ("nefc", "efc_force", "ncon", "contact")
"""Fields of mjData that compiled code reads by their places."""
CONTACT_FIELDS = ("pos", "frame", "includemargin", "friction", "dim", "geom", "efc_address")
"""Fields of mjContact likewise; the distance comes first."""
_OFFSETS: dict[str, tuple[int, ...]] = {"4.0.0": (160576, 162096, 160560, 161488)}
"""Of `FIELDS` [bytes], by version: asking MuJoCo takes as long as 10 s of walking."""
_CONTACT: dict[str, tuple[int, ...]] = {"4.0.0": (608, 8, 32, 104, 112, 552, 564, 600)}
"""Size of a contact and offsets of `CONTACT_FIELDS` in it [bytes], by version."""


class Native(NamedTuple):
    """Addresses by which compiled code steps a model and reads its constraint forces.

    Attributes:
        step: Address of mj_step.
        kinematics: Address of mj_kinematics.
        nefc: Offset [bytes] in mjData of the number of constraint rows.
        force: Offset [bytes] in mjData of the address of their forces.
        count: Offset [bytes] in mjData of the number of contacts.
        contacts: Offset [bytes] in mjData of their address.
    """

    step: int
    kinematics: int
    nefc: int
    force: int
    count: int  # pyright: ignore[reportIncompatibleMethodOverride]
    contacts: int


class ContactLayout(NamedTuple):
    """Places of numbers in a contact of MuJoCo's, counted in doubles or, of the last three, in int32.

    Attributes:
        doubles: Size of a contact.
        place: (3,) [m].
        frame: (9,) its axes.
        margin: [m] within which geoms push each other.
        friction: (5,).
        size: Number of its directions.
        geoms: (2,).
        row: First constraint row, -1: none.
    """

    doubles: int
    place: int
    frame: int
    margin: int
    friction: int
    size: int
    geoms: int
    row: int


class Halves(NamedTuple):
    """Addresses by which compiled code steps a model by halves, with a law between them.

    Attributes:
        step: Address of mj_step.
        step1: Address of mj_step1.
        step2: Address of mj_step2.
        velocities: Address of mj_subtreeVel.
        integrate: Address of mj_integratePos.
        nefc: As of `Native`.
        force: As of `Native`.
        count: As of `Native`.
        contacts: As of `Native`.
    """

    step: int
    step1: int
    step2: int
    velocities: int
    integrate: int
    nefc: int
    force: int
    count: int  # pyright: ignore[reportIncompatibleMethodOverride]
    contacts: int


class _Unavailable(Exception):
    """Compiled code cannot step this model; says why."""


def native(model: mujoco.MjModel, order: Order) -> Native | None:
    """Addresses of a model for compiled code, or None where it must be stepped from Python.

    Args:
        model: The model, which is stepped here once from Python: what MuJoCo finds wrong with it is an exception there,
            but in compiled code the end of the process.
        order: Where it has what.
    """
    return None if reason(model, order) else _library()


def reason(model: mujoco.MjModel, order: Order) -> str:
    """Why compiled code cannot step a model; empty if it can."""
    if model not in _reasons:
        try:
            _check(_library(), model, order)
            _reasons[model] = ""
        except _Unavailable as said:
            _reasons[model] = str(said)
    return _reasons[model]


def halves(model: mujoco.MjModel) -> Halves | None:
    """Addresses of a model of any kind for stepping by halves, or None where it must be stepped from Python.

    Args:
        model: The model, which is stepped here once from Python.
    """
    try:
        native, library = _library(), _shared()
        data = mujoco.MjData(model)
        data.qpos[:] = model.qpos0
        mujoco.mj_step(model, data)
        rows = ctypes.c_int32.from_address(data._address + native.nefc).value
        address = ctypes.c_size_t.from_address(data._address + native.force).value
        if rows != data.nefc or (rows and address != data.efc_force.ctypes.data):
            return None
        one, two, velocities, integrate = (
            ctypes.cast(function, ctypes.c_void_p).value or 0
            for function in (library.mj_step1, library.mj_step2, library.mj_subtreeVel, library.mj_integratePos)
        )
    except (_Unavailable, AttributeError):
        return None
    functions = native.step, one, two, velocities, integrate
    return Halves(*functions, native.nefc, native.force, native.count, native.contacts)


def contact_layout(model: mujoco.MjModel, q: np.ndarray) -> ContactLayout | None:
    """Where compiled code finds a contact's numbers, or None where MuJoCo's bindings say something else.

    Args:
        model: The model, which is not stepped.
        q: (nq,) coordinates at which something touches something.
    """
    try:
        native, version = _library(), mujoco.mj_versionString()
        if version not in _CONTACT:
            _CONTACT[version] = contact_offsets()
    except (_Unavailable, ImportError, AttributeError, KeyError):
        return None
    size, *at = _CONTACT[version]
    data = mujoco.MjData(model)
    data.qpos[:] = q
    mujoco.mj_fwdPosition(model, data)
    count = ctypes.c_int32.from_address(data._address + native.count).value
    first = ctypes.c_size_t.from_address(data._address + native.contacts).value
    found = [getattr(data.contact, name) for name in CONTACT_FIELDS]
    if count != data.ncon or any(
        count and (one.ctypes.data != first + place or one.strides[0] != size)
        for one, place in zip(found, at, strict=True)
    ):
        return None
    return ContactLayout(size // 8, *(place // 8 for place in at[:4]), *(place // 4 for place in at[4:]))


def contact_offsets() -> tuple[int, ...]:
    """Size of a contact and offsets of `CONTACT_FIELDS` in it [bytes], as a C compiler lays them out."""
    laid_out = _structure("mjContact")
    return (ctypes.sizeof(laid_out), *(getattr(laid_out, name).offset for name in CONTACT_FIELDS))


_reasons: WeakKeyDictionary[mujoco.MjModel, str] = WeakKeyDictionary()
"""Of models that have been asked for: a step costs little, but the data to take it in as much as 100 ticks."""


@lru_cache(maxsize=1)
def _shared() -> ctypes.CDLL:
    """The library that MuJoCo's bindings have loaded.

    Raises:
        _Unavailable: It is not where they keep it.
    """
    folder = Path(mujoco.__file__).parent
    found = [file for pattern in ("libmujoco*.so*", "libmujoco*.dylib", "mujoco.dll") for file in folder.glob(pattern)]
    if len(found) != 1:
        raise _Unavailable(f"no single MuJoCo library in {folder}")
    try:
        library = ctypes.CDLL(str(found[0]))
        version = library.mj_version()
    except (OSError, AttributeError) as error:
        raise _Unavailable(f"{found[0].name}: {error}") from None
    if version != mujoco.mj_version():
        raise _Unavailable(f"{found[0].name} is version {version}, not {mujoco.mj_version()}")
    return library


@lru_cache(maxsize=1)
def _library() -> Native:
    if not COMPILED:
        raise _Unavailable("kernels are not compiled (NUMBA_DISABLE_JIT)")
    if ctypes.sizeof(ctypes.c_void_p) != 8:
        raise _Unavailable("addresses do not have 64 bits")
    step, kinematics = (
        ctypes.cast(function, ctypes.c_void_p).value or 0 for function in (_shared().mj_step, _shared().mj_kinematics)
    )
    version = mujoco.mj_versionString()
    if version not in _OFFSETS:
        try:
            _OFFSETS[version] = offsets(FIELDS)
        except (ImportError, AttributeError, KeyError) as error:
            raise _Unavailable(f"mjData of MuJoCo {version} is not described: {error}") from None
    return Native(step, kinematics, *_OFFSETS[version])


def _check(native: Native, model: mujoco.MjModel, order: Order) -> None:
    """Takes one step from Python with everything that can touch touching, and compares what offsets say of it.

    Raises:
        _Unavailable: They say something else.
    """
    if not order.canonical:
        raise _Unavailable("the model file lists its parts in an order of its own")
    data = mujoco.MjData(model)
    if not hasattr(data, "_address") or not hasattr(model, "_address"):
        raise _Unavailable("MuJoCo's bindings do not tell addresses")
    data.qpos[order.joints[list(KNEE)]] = 1e-3
    mujoco.mj_kinematics(model, data)
    data.qpos[order.joints[Z]] -= data.geom_xpos[order.points, 2].max() + 1e-3
    mujoco.mj_step(model, data)
    rows = ctypes.c_int32.from_address(data._address + native.nefc).value
    address = ctypes.c_size_t.from_address(data._address + native.force).value
    if data.nefc < N_ROWS or rows != data.nefc or address != data.efc_force.ctypes.data:
        raise _Unavailable(f"constraint forces are not where MuJoCo {mujoco.mj_versionString()} had them")


_clock_lock = threading.Lock()
_quiet = 0
_clock: int | None = None


@contextmanager
def without_clock() -> Iterator[None]:
    """MuJoCo does not time its stages in this block: a seventh of a small model's step. Results are the same bits.

    The clock is global: it comes back when the last such block of any thread ends. A clock that Python has set
    (`mujoco.set_mjcb_time`) is left alone.
    """
    global _quiet, _clock
    try:
        symbol = ctypes.c_void_p.in_dll(_shared(), "mjcb_time")
    except (_Unavailable, ValueError):
        yield
        return
    with _clock_lock:
        if _quiet == 0:
            _clock = symbol.value
            if mujoco.get_mjcb_time() is None:
                symbol.value = None
        _quiet += 1
    try:
        yield
    finally:
        with _clock_lock:
            _quiet -= 1
            if _quiet == 0 and symbol.value is None:
                symbol.value = _clock


_BASIC = {
    "int": ctypes.c_int,
    "float": ctypes.c_float,
    "double": ctypes.c_double,
    "mjtNum": ctypes.c_double,
    "size_t": ctypes.c_size_t,
    "uintptr_t": ctypes.c_size_t,
    "uint64_t": ctypes.c_uint64,
    "mjtSize": ctypes.c_int64,
    "mjtByte": ctypes.c_ubyte,
    "mjtBool": ctypes.c_bool,
}
"""The C types that structs are made of; enumerations are ints."""


def offsets(names: tuple[str, ...]) -> tuple[int, ...]:
    """Offsets [bytes] of fields of mjData, as a C compiler lays them out.

    Raises:
        KeyError: MuJoCo describes no such field, or one of a type that is not known here.
    """
    laid_out = _structure("mjData")
    known = {name for name, *_ in laid_out._fields_}
    missing = [name for name in names if name not in known]
    if missing:
        raise KeyError(missing[0])
    return tuple(getattr(laid_out, name).offset for name in names)


def _structure(name: str) -> type[ctypes.Structure]:
    from mujoco.introspect import structs

    described: tuple[Any, ...] = structs.STRUCTS[name].fields
    fields = [(field.name, _type(field.type)) for field in described]
    return type(name, (ctypes.Structure,), {"_fields_": fields})


def _type(described: Any) -> Any:
    from mujoco.introspect import ast_nodes, enums

    if isinstance(described, ast_nodes.PointerType):
        return ctypes.c_void_p
    if isinstance(described, ast_nodes.ArrayType):
        inner = _type(described.inner_type)
        for extent in reversed(described.extents):
            inner = inner * extent
        return inner
    if described.name in _BASIC:
        return _BASIC[described.name]
    return ctypes.c_int if described.name in enums.ENUMS else _structure(described.name)
