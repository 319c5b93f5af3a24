"""Copies have numbers behind their names."""

import pytest

from rasp_core.util.numbering import numbered


@pytest.mark.parametrize(
    ("name", "kind", "number"),
    [("bolt", "bolt", 1), ("bolt#2", "bolt", 2), ("bolt#12", "bolt", 12), ("bolt#old", "bolt", 1), ("a#2#3", "a", 1)],
)
def test_a_name_is_a_kind_and_a_number(name, kind, number):
    assert numbered(name) == (kind, number)
