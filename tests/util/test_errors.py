"""What users are told is caught in one place."""

from data_fetch import errors as fetch_errors
from rasp_core.util.errors import InputError, MeshError


def test_every_error_for_bad_input_is_an_input_error():
    assert issubclass(MeshError, InputError)
    for name in ("FetchError", "HashMismatch", "DownloadInterrupted", "NoNetwork", "NotOnServer", "MissingInMirror"):
        assert issubclass(getattr(fetch_errors, name), InputError)
