"""Clips of runs, drawn by MuJoCo off the screen: `biped video`.

MuJoCo draws with EGL where there is one, else with OSMesa, else a sentence says so. A GIF is written with what is
installed anyway, an MP4 with an extra.
"""

import math
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import NamedTuple

import mujoco
import numpy as np

from biped.base.errors import InputError, RunError, short
from biped.base.writing import Kind, may_write, written
from biped.show.film.stage import FilmedWalker, FilmStage, camera_of, walkers
from biped.show.results_folder import run_of
from biped.studies.folders import writing

_PROBE = "from mujoco.{0} import GLContext; c = GLContext(16, 16); c.make_current()"
_HINT = "Debian: apt-get install libegl1 libgl1-mesa-dri, or libosmesa6"
_PATIENCE = 60.0


class Canvas:
    """Where frames are drawn.

    Args:
        model: The model, whose context is made; its off-screen size is set.
        width: [px].
        height: [px].
        current: Makes its context of OpenGL the one that is drawn with.

    Attributes:
        height: [px].
    """

    def __init__(self, model: mujoco.MjModel, width: int, height: int, current: Callable[[], None]):
        current()
        self._current, self.height = current, height
        model.vis.global_.offwidth, model.vis.global_.offheight = width, height
        self._view = mujoco.MjrRect(0, 0, width, height)
        letters = mujoco.mjtFontScale.mjFONTSCALE_100 if height < 900 else mujoco.mjtFontScale.mjFONTSCALE_200
        self._context = mujoco.MjrContext(model, letters.value)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, self._context)
        self._pixels = np.empty((height, width, 3), np.uint8)

    def draw(self, scene: mujoco.MjvScene, names: str, values: str) -> np.ndarray:
        """A scene with two columns of words in its corner as (height, width, 3) bytes; valid until the next."""
        self._current()
        mujoco.mjr_render(self._view, scene, self._context)
        place = mujoco.mjtGridPos.mjGRID_TOPLEFT.value
        mujoco.mjr_overlay(mujoco.mjtFont.mjFONT_NORMAL.value, place, self._view, names, values, self._context)
        mujoco.mjr_readPixels(self._pixels, None, self._view, self._context)
        return self._pixels[::-1]

    def close(self) -> None:
        """Frees what the context holds."""
        self._current()
        self._context.free()


@contextmanager
def off_screen(model: mujoco.MjModel, width: int, height: int) -> Iterator[Canvas]:
    """A canvas until the block ends.

    Raises:
        InputError: Nothing here can draw.
    """
    context = _context(width, height)
    try:
        drawn = Canvas(model, width, height, context.make_current)
        try:
            yield drawn
        finally:
            drawn.close()
    finally:
        context.free()


def platform() -> str:
    """The library that draws off the screen on Linux: what MUJOCO_GL says, else the first that works.

    Each is tried in a process of its own: one that is broken may end it.

    Raises:
        InputError: None works.
    """
    wanted = os.environ.get("MUJOCO_GL", "").lower().strip()
    choice = (wanted,) if wanted in ("egl", "osmesa") else ("egl", "osmesa")
    for name in choice:
        environment = {key: value for key, value in os.environ.items() if key != "PYOPENGL_PLATFORM"}
        try:
            done = subprocess.run(
                [sys.executable, "-c", _PROBE.format(name)], env=environment, capture_output=True, timeout=_PATIENCE,
                check=False,
            )  # fmt: skip
        except subprocess.TimeoutExpired:
            continue
        if done.returncode == 0:
            return name
    raise InputError(f"video: MuJoCo cannot draw here: tried {' and '.join(choice)}, neither works; {_HINT}")


def _context(width: int, height: int):
    """A context of OpenGL off the screen."""
    if sys.platform != "linux":
        from mujoco.gl_context import GLContext

        return GLContext(width, height)
    name = platform()
    os.environ["PYOPENGL_PLATFORM"] = name
    if name == "egl":
        from mujoco.egl import GLContext
    else:
        from mujoco.osmesa import GLContext
    return GLContext(width, height)


SHAPE = 16 / 9
MOST = 6
"""Most runs of a clip."""
_ROOMY = 280
"""[px] of a picture's height from which words have more than a line."""


class Cut(NamedTuple):
    """How a clip is cut.

    Attributes:
        width: [px].
        height: [px]; None: as wide screens are.
        rate: [Hz] of frames; None: 30 of an MP4, 20 of a GIF.
        start: [s] from here.
        end: [s] to here; None: to the end of the longest run.
        slow: How many times slower than life.
        eye: Where it is seen from (`biped.show.film.stage`).
        ghost: Whether the second run is a shadow over the first, not beside it.
        apart: Whether every run has a picture of its own, side by side; more than two always have.
    """

    width: int = 640
    height: int | None = None
    rate: float | None = None
    start: float = 0.0
    end: float | None = None
    slow: float = 1.0
    eye: str = "three-quarters"
    ghost: bool = False
    apart: bool = False


def film(results: Sequence[Path], out: Path, cut: Cut, only: int | None = None) -> int:
    """Writes a clip of runs.

    Args:
        results: Results folders; of a campaign, the walker of median speed.
        out: The file, *.mp4 or *.gif.
        cut: How it is cut.
        only: Number of the run, where folders hold several.

    Returns:
        The number of frames.

    Raises:
        InputError: A folder holds no results, nothing here can draw or encode, or the file cannot be written.
    """
    check(out)
    rate = cut.rate or (20.0 if out.suffix.lower() == ".gif" else 30.0)
    camera = camera_of(cut.eye)
    _bounds(cut, rate, len(results))
    runs = [run_of(path, only) for path in results]
    pictures = [walkers([run], False) for run in runs] if cut.apart or len(runs) > 2 else [walkers(runs, cut.ghost)]
    last = max(walker.end for shown in pictures for walker in shown)
    end = last if cut.end is None else min(cut.end, last)
    if end <= cut.start:
        raise InputError(f"--from {cut.start:g}: expected a time before the end of the run, {last:g} s")
    times = np.arange(cut.start, end, 1.0 / (rate * cut.slow))
    height = 2 * round((cut.height or cut.width / SHAPE) / 2)
    width = 2 * (cut.width // len(pictures) // 2)
    with ExitStack() as stack:
        scenes = []
        for shown in pictures:
            stage = FilmStage(shown, rate * cut.slow, camera, width / height)
            scenes.append((shown, stage, stack.enter_context(off_screen(stage.model, width, height))))
        wind(out, _frames(scenes, times), width * len(pictures), height, rate)
    return len(times)


def _frames(scenes: Sequence[tuple[list[FilmedWalker], FilmStage, Canvas]], times: np.ndarray) -> Iterator[np.ndarray]:
    """Pictures side by side at every time; valid until the next."""
    short = len(scenes) > 1 or scenes[0][2].height < _ROOMY
    for time in times:
        drawn = [canvas.draw(stage.at(float(time)), *_words(shown, float(time), short))
                 for shown, stage, canvas in scenes]  # fmt: skip
        yield drawn[0] if len(drawn) == 1 else np.concatenate(drawn, axis=1)


def _words(shown: Sequence[FilmedWalker], time: float, short: bool) -> tuple[str, str]:
    """Names and values in the corner of a picture, which may have little room."""
    first = shown[0]
    row = int(np.clip(round((time - first.run.time[0]) / first.run.tick), 0, len(first.run) - 1))
    ended = time > first.run.time[-1] and first.run.end == "fell"
    speed = "fell" if ended else f"{first.speed[row]:5.2f} m/s"
    names = ["run", "time", "speed", *("beside" if not other.ghost else "ghost" for other in shown[1:])]
    values = [first.name, f"{time:5.2f} s", speed, *(other.name for other in shown[1:])]
    if short:
        return f"{first.name} {time:.2f} s", ""
    return "\n".join(names), "\n".join(values)


def _bounds(cut: Cut, rate: float, runs: int) -> None:
    if runs > MOST:
        raise InputError(f"video: expected at most {MOST} runs, got {runs}")
    if cut.ghost and (runs != 2 or cut.apart):
        raise InputError("--ghost: expected two runs in one picture, the second of which is the ghost")
    if not 64 <= cut.width <= 3840:
        raise InputError(f"--width {cut.width}: expected 64 … 3840 pixels")
    if cut.height is not None and not 36 <= cut.height <= 2160:
        raise InputError(f"--size: expected a height of 36 … 2160 pixels, got {cut.height}")
    if not (math.isfinite(rate) and 1.0 <= rate <= 120.0):
        raise InputError(f"--fps {rate:g}: expected 1 … 120")
    if not 0.1 <= cut.slow <= 100.0:
        raise InputError(f"--slow {cut.slow:g}: expected how many times slower than life, 0.1 … 100")
    if not (math.isfinite(cut.start) and cut.start >= 0.0):
        raise InputError(f"--from {cut.start:g}: expected a time [s] from 0 on")
    if cut.end is not None and not cut.end > cut.start:
        raise InputError(f"--to {cut.end:g}: expected a time [s] after --from")


KIND = Kind("a clip", (".mp4", ".gif"), (b"ftypisom", b"GIF89a"))
_COLOURS, _SAMPLED = 128, 30


def check(out: Path) -> None:
    """Complains before anything is drawn.

    Raises:
        InputError: The file cannot be made.
    """
    may_write(out, "--out", KIND)
    if not out.absolute().parent.is_dir():
        raise InputError(f"--out {out}: cannot be written: expected a file in a folder that exists")
    if out.suffix.lower() == ".mp4":
        _ffmpeg()


def wind(out: Path, frames: Iterable[np.ndarray], width: int, height: int, rate: float) -> None:
    """Writes frames (height, width, 3) of bytes to a file; it is there whole or not at all.

    Raises:
        InputError: It cannot be written, or the extra is missing.
    """
    with writing(f"--out {out}"), written(out) as part:
        (_mp4 if out.suffix.lower() == ".mp4" else _gif)(part, frames, width, height, rate)


def _ffmpeg() -> str:
    """The encoder's program, which the extra brings."""
    try:
        import imageio_ffmpeg
    except ImportError:
        raise InputError(
            "video: *.mp4 needs the package 'imageio-ffmpeg'; install it with: pip install imageio-ffmpeg; *.gif needs "
            "nothing more"
        ) from None
    return imageio_ffmpeg.get_ffmpeg_exe()


def _mp4(part: Path, frames: Iterable[np.ndarray], width: int, height: int, rate: float) -> None:
    """H.264 in the colours that every player reads."""
    command = [
        _ffmpeg(), "-y", "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}",
        "-r", f"{rate:g}", "-i", "-", "-an", "-c:v", "libx264", "-crf", "23", "-pix_fmt", "yuv420p",
        "-movflags", "+faststart", "-f", "mp4", str(part),
    ]  # fmt: skip
    with (
        tempfile.TemporaryFile() as told,
        subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=told) as encoder,
    ):
        assert encoder.stdin is not None
        with suppress(BrokenPipeError):  # it says why when it has ended
            for frame in frames:
                encoder.stdin.write(np.ascontiguousarray(frame).data)
            encoder.stdin.close()
        if encoder.wait() != 0:
            told.seek(0)
            raise RunError(f"video: the encoder failed: {short(told.read().decode(errors='replace').strip(), 300)}")


def _gif(part: Path, frames: Iterable[np.ndarray], width: int, height: int, rate: float) -> None:
    """One palette for all frames, so that what stands still stays the same."""
    from PIL import Image

    pictures = [Image.fromarray(frame.copy()) for frame in frames]
    # Frames of the whole clip: what is seen for a moment, such as a push, has its colours too.
    chosen = pictures[:: max(1, len(pictures) // _SAMPLED)]
    sample = Image.new("RGB", (width, len(chosen) * height))
    for i, picture in enumerate(chosen):
        sample.paste(picture, (0, i * height))
    palette = sample.quantize(_COLOURS, method=Image.Quantize.FASTOCTREE)
    first, *rest = [picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures]
    # A GIF's times are hundredths of a second.
    first.save(part, format="GIF", save_all=True, append_images=rest, duration=10 * round(100 / rate), loop=0)
