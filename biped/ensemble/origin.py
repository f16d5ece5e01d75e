"""The origin of runs, the files and versions they depend on. Rows of different origin never mix in one journal."""

from hashlib import blake2b
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from biped.base import VERSION
from biped.base.files import PACKAGE, description_of, layered, locate
from biped.base.kernels import digest
from biped.base.platform import here
from biped.ensemble.plan import Plan
from biped.robot.safety import files_of as model_files
from biped.scenario.engines import ENGINES
from biped.scenario.laws import files_of as law_files
from biped.scenario.laws import own_law
from biped.scenario.reading import to_toml

PLACE = ("system", "libc", "instructions", "blas")
"""Of an origin, what kind of machine it is: on another kind, the last bits may be others."""


_MORE = ("scenario", "ensemble")
"""Rooms without kernels that runs come from: what a scenario means, and what is drawn."""


def origin_of(plan: Plan) -> dict[str, str]:
    """Digest of the effective scenario and of every file that its runs read; versions; and platform.

    Of libraries that not every run needs, an engine's or onnxruntime, only those count that these runs use.
    """
    state = blake2b(to_toml(plan.scenario).encode(), digest_size=8)
    files = files_read_by(plan)
    for path in files:
        data = path.read_bytes()
        state.update(f"{path.name}\0{len(data)}\0".encode() + data)
    libraries = [ENGINES[plan.scenario.engine].library, *("onnxruntime" for path in files if path.suffix == ".onnx")]
    return {
        "scenario": state.hexdigest(),
        "biped": VERSION,
        "kernels": digest(PACKAGE, _MORE),
        **here(),
        **{name: installed(name) for name in libraries if name},
    }


def files_read_by(plan: Plan) -> list[Path]:
    """Files that runs of a plan read: models with what they include and their descriptions, gaits, and the law's.

    Gaits and readings count where they vary, or the speed of a family does; else they are written out in the scenario.

    Raises:
        InputError: A file cannot be read.
    """
    s = plan.scenario
    varied: dict[str, list[object]] = {key: list(values) for key, values in s.sweep.items()}
    for key, drawn in s.randomise.draw.items():
        varied.setdefault(key, []).extend(drawn.choice or drawn.grid or ())
    models = [plan.model, *(locate("models", str(name), "model") for name in varied.get("model", ()))]
    files = [file for model in models for file in (*model_files(model), description_of(model))]
    if any(key.endswith(("controller", "reading", "gains.speed")) for key in varied):
        for kind, own in (("controller", s.controller), ("reading", s.reading)):
            names = [own or "", *(str(name) for key in varied if key.endswith(kind) for name in varied[key])]
            found = [locate(f"{kind}s", name, kind) for name in names if name]
            files += [file for path in found for file in (path, *layered(path, f"{kind}s")[1].values())]
    if s.law is not None and own_law(s.law):
        files += law_files(s.law)
    return list(dict.fromkeys(file.resolve() for file in files))


def installed(name: str) -> str:
    """The version of a package that is installed; empty of one that is not."""
    try:
        return version(name)
    except PackageNotFoundError:
        return ""
