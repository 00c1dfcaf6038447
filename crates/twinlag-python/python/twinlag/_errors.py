"""Exceptions of twinlag."""

from __future__ import annotations


class RecordError(ValueError):
    """A record that cannot be used, or that the question does not fit.

    The message says what was expected, what came, where, and what to do.

    Attributes
    ----------
    file : str or None
        The file that the message is about, where it is about a line of one.
    line : int or None
        The line, from 1.
    """

    def __init__(self, message: str, file: str | None = None, line: int | None = None) -> None:
        super().__init__(message)
        self.file = file
        self.line = line

    def __reduce__(self) -> tuple[type[RecordError], tuple[str, str | None, int | None]]:
        return type(self), (str(self), self.file, self.line)
