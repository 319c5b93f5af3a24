"""Names of copies: `bolt`, `bolt#2`, `bolt#3` are of one kind."""

from __future__ import annotations


def numbered(name: str) -> tuple[str, int]:
    """A name's kind, and which of them it is; 1 if it has no number.

    >>> numbered("bolt#3"), numbered("bolt")
    (('bolt', 3), ('bolt', 1))
    """
    kind, _, number = name.partition("#")
    return kind, int(number) if number.isdecimal() else 1
