"""Progress of long work, as callbacks: whoever starts it hands them in, and nobody below prints."""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager

Progress = Callable[[str, int, int], AbstractContextManager[Callable[..., None]]]
"""Called with a title, how many pieces of work there are and how many are done; gives what is called when pieces are
finished: without arguments for one, else with how many they are and words on who works."""

Told = Callable[[str], None]
"""Called with what a person should know although nothing failed."""


@contextmanager
def silent(title: str, total: int, done: int) -> Iterator[Callable[..., None]]:
    """Progress that nobody watches."""
    yield lambda *_: None


def unheard(words: str) -> None:
    """Drops words that nobody listens to."""
