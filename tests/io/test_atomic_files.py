"""Files are whole or not there, and nothing is left beside them."""

import pytest

from rasp_core.io.atomic_files import whole


def test_a_file_appears_when_it_is_whole(tmp_path):
    path = tmp_path / "facts.json"
    with whole(path) as part:
        part.write_text("half")
        assert not path.exists()
        part.write_text("whole")
    assert path.read_text() == "whole"
    assert list(tmp_path.iterdir()) == [path]


def fail_after_half(part):
    part.write_text("half")
    raise OSError("disk full")


def test_a_failure_leaves_the_file_that_was_there(tmp_path):
    path = tmp_path / "facts.json"
    path.write_text("before")
    with pytest.raises(OSError, match="disk full"), whole(path) as part:
        fail_after_half(part)
    assert path.read_text() == "before"
    assert list(tmp_path.iterdir()) == [path]


def test_a_folder_that_is_not_there(tmp_path):
    with pytest.raises(FileNotFoundError), whole(tmp_path / "none" / "facts.json") as part:
        part.write_text("whole")
