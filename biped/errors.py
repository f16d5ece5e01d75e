"""The one family of errors that users see: each says what is wrong, where, and what to do."""


class BipedError(Exception):
    """Base of every error biped raises on purpose; the command line prints it without a traceback."""


class InputError(BipedError):
    """Something the user wrote cannot be used (exit code 2)."""


class RunError(BipedError):
    """A run could not be carried to its end (exit code 1): says time, quantity and cause."""
