"""A terminal that obeys us alone: whatever stands in a scenario, a result or an error is printed, not carried out."""

from __future__ import annotations

import re
from typing import Any

from rich.console import Console
from rich.errors import MarkupError
from rich.text import Text

from biped.base.text import plain

_OPENING = re.compile(r"(\\*)\[(/?(?:bold|dim|red|green|yellow)\])?")
"""A bracket, the backslashes before it, and the rest of a style of ours if it is one."""


class SafeConsole(Console):
    """A console for texts that hold words of somebody else.

    Styles that we use ourselves (`[bold]`, `[red]`, …) are markup; everything else in brackets is text, there are no
    links and no emoji, and control characters are written out.
    """

    def __init__(self, **settings: Any):
        super().__init__(**settings, highlight=False, emoji=False)

    def render_str(self, text: str, **settings: Any) -> Text:
        """See `rich.console.Console.render_str`."""
        text = "\n".join(plain(line) for line in text.split("\n"))
        try:
            return super().render_str(_OPENING.sub(_escaped, text), **settings)
        except MarkupError:  # a style that ends without having begun
            return super().render_str(text, **{**settings, "markup": False})


def _escaped(found: re.Match[str]) -> str:
    backslashes, ours = found.groups()
    return f"{backslashes * 2}[{ours}" if ours else f"{backslashes * 2}\\["
