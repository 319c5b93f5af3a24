"""What can go wrong when data is fetched; each message says what was expected, what came and what to do."""

from __future__ import annotations

from rasp_core.util.errors import InputError


class FetchError(InputError):
    """A data file could not be had."""


class HashMismatch(FetchError):
    """A file is not the one that the registry names."""


class DownloadInterrupted(FetchError):
    """A download stalled or ended early."""


class NoNetwork(FetchError):
    """The server could not be reached."""


class NotOnServer(FetchError):
    """The server answered, but not with the file."""


class MissingInMirror(FetchError):
    """`RASP_DATA_MIRROR` names a folder without the file."""
