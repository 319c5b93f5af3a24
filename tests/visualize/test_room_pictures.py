"""The sheet of a room is a page that parses, and says the room's measures."""

import xml.etree.ElementTree as ET

import numpy as np

from rasp_core.art.room_file import room_of
from rasp_core.visualize.room_pictures import sheet

ROOM = {
    "heap": [0, 0, 1],
    "surfaces": {"wall <1>": {"point": [0, 0.4, 0], "normal": [0, 1, 0]}},
    "lamps": [{"at": [0, -0.6, 1], "onto": "wall <1>", "height": 0.4}],
}


def test_the_sheet_says_distances_and_names_safely():
    shadows = np.zeros((1, 32, 32), bool)
    text = sheet(room_of(ROOM), np.array([0.2, 0.1, 0.24]), 0.5, shadows, [0.97])
    page = ET.fromstring(text.removeprefix("<!DOCTYPE html>").replace('<meta charset="utf-8">', ""))
    rows = {row[0].text: row[1].text for row in page.iter("tr")}
    assert rows["lamp 1, to the heap's middle"] == "0.600 m"
    assert rows["lamp 1, before the wall <1>, straight"] == "1.000 m"
    assert rows["wall <1>, against the floor's level"] == "90.0 degrees"
    assert rows["shadow 1, its top left corner"] == "x -0.200  y 0.400  z 1.200 m"
    assert rows["heap, its size"] == "x 0.200  y 0.100  z 0.240 m"
    assert rows["shadow 1, like its picture"] == "97.0%"
    assert len(list(page.iter("svg"))) == 2
