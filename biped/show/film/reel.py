"""Frames into a file: GIF with what is installed anyway, MP4 with an extra."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from biped.base.errors import InputError, RunError
from biped.base.writing import reason, written

SUFFIXES = (".mp4", ".gif")
_COLOURS, _SAMPLED = 128, 30


def check(out: Path) -> None:
    """Complains before anything is drawn.

    Raises:
        InputError: The file cannot be made.
    """
    if out.suffix.lower() not in SUFFIXES:
        raise InputError(f"--out {out}: expected a file *.mp4 or *.gif")
    if not out.absolute().parent.is_dir():
        raise InputError(f"--out {out}: cannot be written: expected a file in a folder that exists")
    if out.suffix.lower() == ".mp4":
        _ffmpeg()


def wind(out: Path, frames: Iterable[np.ndarray], width: int, height: int, rate: float) -> None:
    """Writes frames (height, width, 3) of bytes to a file; it is there whole or not at all.

    Raises:
        InputError: It cannot be written, or the extra is missing.
    """
    try:
        with written(out) as part:
            (_mp4 if out.suffix.lower() == ".mp4" else _gif)(part, frames, width, height, rate)
    except OSError as error:
        raise InputError(f"--out {out}: cannot be written: {reason(error)}") from None


def _ffmpeg():
    try:
        import imageio_ffmpeg
    except ImportError:
        raise InputError(
            "video: *.mp4 needs the package 'imageio-ffmpeg'; install it with: pip install 'biped[video]'; *.gif needs "
            "nothing more"
        ) from None
    return imageio_ffmpeg


def _mp4(part: Path, frames: Iterable[np.ndarray], width: int, height: int, rate: float) -> None:
    writer = _ffmpeg().write_frames(
        str(part), (width, height), fps=rate, codec="libx264", quality=7, macro_block_size=2,
        output_params=["-f", "mp4", "-movflags", "+faststart"], ffmpeg_log_level="error",
    )  # fmt: skip
    writer.send(None)
    try:
        for frame in frames:
            writer.send(np.ascontiguousarray(frame))
    finally:
        writer.close()
    if not part.is_file() or part.stat().st_size == 0:
        raise RunError("video: the encoder wrote nothing")


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
