"""A network of an ONNX file: its session, its hidden state, its widths."""

import os
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from biped.base.errors import InputError
from biped.base.files import label

NEEDS = "a policy network needs onnxruntime, which is not installed; pip install onnxruntime"


class Network:
    """A network during one run; the hidden state of a recurrent one goes from call to call.

    Args:
        file: The ONNX file: its first input takes an observation, its first output is the action; the others, in the
            same order, are the hidden state.

    Attributes:
        size: How many numbers it takes; None: any.
        actions: How many it returns; None: any.

    Raises:
        InputError: It is no such network, or onnxruntime is not installed.
    """

    def __init__(self, file: Path):
        self._session, self._inputs, outputs = _session(str(file), file.stat().st_mtime, os.getpid())
        if len(self._inputs) != len(outputs):
            raise InputError(f"{label(file)}: expected as many hidden states out as in, got "
                             f"{len(self._inputs) - 1} in and {len(outputs) - 1} out", "law")  # fmt: skip
        self.size, self.actions = (_width(one[0]) for one in (self._inputs, outputs))
        self._name = self._inputs[0].name
        self._hidden = [np.zeros([d if isinstance(d, int) else 1 for d in one.shape], np.float32)
                        for one in self._inputs[1:]]  # fmt: skip

    def ask(self, observed: np.ndarray) -> np.ndarray:
        """(actions,) what it returns for an observation (size,) of 32-bit floats."""
        feed = {self._name: observed[None]}
        for one, value in zip(self._inputs[1:], self._hidden, strict=True):
            feed[one.name] = value
        found: Any = self._session.run(None, feed)
        self._hidden = list(found[1:])
        return np.asarray(found[0], dtype=np.float32).reshape(-1)


def metadata(file: Path) -> dict[str, str]:
    """Words that a trainer wrote into an ONNX file, by name.

    Raises:
        InputError: It is no such file, or onnxruntime is not installed.
    """
    session, _, _ = _session(str(file), file.stat().st_mtime, os.getpid())
    return dict(session.get_modelmeta().custom_metadata_map)


def _width(one: Any) -> int | None:
    width = one.shape[-1] if one.shape else 1
    return width if isinstance(width, int) else None


@lru_cache(maxsize=8)
def _session(file: str, modified: float, process: int) -> tuple[Any, list[Any], list[Any]]:
    """A network, its inputs and its outputs; one of each process."""
    try:
        session = session_of(file)
    except ImportError as error:
        raise InputError(f"law: {error}", "law") from None
    except ValueError as error:
        raise InputError(f"{label(Path(file))}: {error}", "law") from None
    return session, list(session.get_inputs()), list(session.get_outputs())


def session_of(file: str) -> Any:
    """A session of onnxruntime that runs a network in one thread.

    Raises:
        ValueError: The file is no network.
        ImportError: onnxruntime is not installed.
    """
    try:
        import onnxruntime
    except ImportError:
        raise ImportError(NEEDS) from None
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1  # small networks gain nothing from more
    options.log_severity_level = 4
    try:
        return onnxruntime.InferenceSession(file, options, providers=["CPUExecutionProvider"])
    except Exception as error:
        raise ValueError(f"not an ONNX network: {' '.join(str(error).split())[:200]}") from None
