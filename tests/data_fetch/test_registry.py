"""The registry is whole and agrees with the files, where they are at hand."""

import hashlib

import pytest

from data_fetch.registry import GROUPS, entries

COUNTS = {"kitchen": 106, "general": 34, "blockout": 24, "cad": 32, "containers": 7, "fracture": 24, "targets": 4}
COUNTS["nesting"] = 52


@pytest.mark.parametrize("group", GROUPS)
def test_every_file_has_a_url_a_hash_and_a_licence_note(group):
    rows = entries(group)
    assert len(rows) == COUNTS[group]
    assert [row.name for row in rows] == sorted(row.name for row in rows)
    for row in rows:
        assert row.url.startswith("https://raw.githubusercontent.com/")
        assert len(row.sha256) == 64
        assert row.bytes > 0
        assert row.licence


def test_an_unknown_set_is_refused():
    with pytest.raises(KeyError, match="kitchen"):
        entries("bathroom")


@pytest.mark.real_data
@pytest.mark.parametrize("group", GROUPS)
def test_hashes_are_those_of_the_files(data, group):
    for row in entries(group):
        assert hashlib.sha256((data / group / row.name).read_bytes()).hexdigest() == row.sha256, row.name
