"""Rooms as files: what is read, and the line that says what is wrong."""

import json
import re

import pytest

from rasp_core.art import room_file
from rasp_core.art.room_file import read_room, room_of
from rasp_core.util.errors import InputError

ROOM = {
    "heap": [0, 0, 1],
    "surfaces": {"wall": {"point": [0, 0.45, 0], "normal": [0, -1, 0]}},
    "lamps": [{"at": [0, -0.55, 1], "onto": "wall", "height": 0.4}],
}


def test_a_room_is_read_and_said_as_it_was(tmp_path):
    path = tmp_path / "room.json"
    path.write_text(json.dumps(ROOM))
    assert read_room(path).to_dict() == ROOM


def test_a_file_that_is_no_room_is_named(tmp_path, monkeypatch):
    for name, text in (("a.json", "{"), ("b.json", "[" * 100_000), ("c.json", json.dumps(ROOM | {"heap": 3}))):
        (tmp_path / name).write_text(text)
        with pytest.raises(InputError, match=re.escape(name)):
            read_room(tmp_path / name)
    with pytest.raises(InputError, match=r"none\.json: cannot be read as a room"):
        read_room(tmp_path / "none.json")
    monkeypatch.setattr(room_file, "LARGEST", 1)
    with pytest.raises(InputError, match="more than 1 bytes"):
        read_room(tmp_path / "c.json")


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"heap": [0, 0]}, "'heap' of a room must be three numbers, got"),
        ({"heap": [0, 0, float("nan")]}, "must be three numbers"),
        ({"lamps": None}, "a room needs 'lamps'"),
        ({"lamps": [3]}, "lamp 1 needs 'onto'"),
        ({"lamps": [ROOM["lamps"][0] | {"onto": "roof"}]}, "lamp 1 shines onto 'roof', which is none of wall"),
        ({"lamps": [ROOM["lamps"][0] | {"height": 0}]}, "height of a shadow must be positive, got 0 at lamp 1"),
        ({"surfaces": {"wall": {"point": [0, 1, 0], "normal": [0, 0, 0]}}}, "normal of surface wall must not be 0"),
    ],
)
def test_what_is_missing_is_said(change, says):
    with pytest.raises(InputError, match=says):
        room_of(ROOM | change)
