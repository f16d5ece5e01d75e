"""`biped video`: a clip of one run, or of two."""

from __future__ import annotations

import argparse

from biped.cli.common import DONE
from biped.show.film import Cut, film


def command(args: argparse.Namespace) -> int:
    """Draws and writes it."""
    cut = Cut(args.width, args.fps, args.start, args.end)
    frames = film(args.run, args.out, cut, args.ghost, args.only)
    print(f"{args.out}: {frames} frames, {args.out.stat().st_size / 1e6:.2f} MB")
    return DONE
