"""The one family of errors that users see: each says what is wrong, where, and what to do."""


class BipedError(Exception):
    """Base of every error biped raises on purpose; the command line prints it without a traceback."""


class InputError(BipedError):
    """Something the user wrote cannot be used (exit code 2).

    Args:
        message: One paragraph: file, key, what was expected, the nearest valid name.
        key: Key of the scenario that the message begins with, where the file it comes from is yet to be named.
    """

    def __init__(self, message: str, key: str | None = None):
        super().__init__(message)
        self.key = key


class RunError(BipedError):
    """A run could not be carried to its end (exit code 1): says time, quantity and cause."""
