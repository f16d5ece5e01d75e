"""The terminal: documents drawn on it, and how far runs are."""

import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rich.console import Console
from rich.errors import MarkupError
from rich.table import Table
from rich.text import Text

from biped.base.errors import plain
from biped.show import document
from biped.show.document import Document, Heading, Items, Line, Paragraph, Picture, pieces

_STYLES = {"strong": "bold", "good": "green", "bad": "red", "doubt": "yellow"}
"""How pieces of a line stand out."""


def console() -> Console:
    """The terminal; plain and wide enough for tables when it is a file or a pipe."""
    return SafeConsole(width=None if sys.stdout.isatty() else 120)


def show(content: Document) -> None:
    """Prints a document."""
    out = console()
    for block in content:
        if isinstance(block, Heading):
            out.print(f"[bold]{_styled(block.line)}[/bold]")
        elif isinstance(block, Paragraph):
            line = _styled(block.line)
            out.print(f"  [dim]{line}[/dim]" if block.note else f"  {line}", soft_wrap=block.note)
        elif isinstance(block, Items):
            for line in block.lines:
                out.print(f"    {_styled(line)}")
        elif isinstance(block, Picture):
            out.print(f"  {block.title}: {block.path}")
        else:
            out.print(_drawn(block))


def _drawn(block: document.Table) -> Table:
    heads = [_styled(line) for line in block.head]
    out = Table(box=None, pad_edge=False, header_style="dim", show_header=any(heads))
    for i, head in enumerate(heads):
        out.add_column(head, justify="left" if i in block.words else "right", overflow="fold")
    for row in block.rows:
        out.add_row(*map(_styled, row))
    return out


def _styled(line: Line) -> str:
    """A line in the console's own markup, which `SafeConsole` tells from a stranger's brackets."""
    words = ((one.text, _STYLES.get(one.kind)) for one in pieces(line))
    return "".join(f"[{style}]{text}[/{style}]" if style else text for text, style in words)


@contextmanager
def progress(title: str, total: int, done: int) -> Iterator[Any]:
    """A progress bar on stderr, only if that is a terminal; yields a function to call per finished run."""
    if not sys.stderr.isatty() or total < 2:
        yield lambda *_: None
        return
    from rich import progress as bar

    columns = (
        bar.TextColumn("{task.description}"), bar.BarColumn(), bar.MofNCompleteColumn(),
        bar.TextColumn("{task.fields[rate]}"), bar.TimeRemainingColumn(),
    )  # fmt: skip
    with bar.Progress(*columns, console=SafeConsole(stderr=True), transient=True) as shown:
        task = shown.add_task(title, total=total, completed=done, rate="")

        def advance(count: int = 1, words: str = "") -> None:
            shown.advance(task, count)
            speed = shown.tasks[0].speed
            rate = f"{speed:.1f} runs/s" if speed else ""
            shown.update(task, rate=", ".join(filter(None, (rate, words))))

        yield advance


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
