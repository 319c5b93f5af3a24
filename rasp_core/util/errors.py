"""The errors that the kit raises for input that cannot be used."""

from __future__ import annotations


class InputError(ValueError):
    """Something given by the user cannot be used; the message names it and the remedy in one line."""


class MeshError(InputError):
    """A mesh that cannot be read, or that bounds no solid."""


class MeshWarning(UserWarning):
    """What was done to a file's surface to make a solid of it, or left out of the file."""


class PictureWarning(MeshWarning):
    """What was guessed to read a picture as a person would see it."""
