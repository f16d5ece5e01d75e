"""Frames into a file: GIF with what is installed anyway, MP4 with an extra."""

import subprocess
import tempfile
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

import numpy as np

from biped.base.errors import InputError, RunError
from biped.base.replacing import Kind, may_write
from biped.base.text import short
from biped.base.writing import written
from biped.studies.folders import writing

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
