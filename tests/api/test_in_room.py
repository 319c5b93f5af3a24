"""A heap in a room, at the door: its shadows, its picture, its sheet."""

import json
import re

import numpy as np
import pytest
from oracles import iou, thrown
from PIL import Image

import rasp_core as rasp
from data_fetch import kitchen_like
from rasp_core.api.in_room import room_for
from rasp_core.cli.main import main
from rasp_core.util.errors import InputError

ROOM = {
    "heap": [0, 0, 1],
    "surfaces": {
        "wall": {"point": [0, 0.5, 0], "normal": [0, 1, 0]},
        "floor": {"point": [0, 0, 0.5], "normal": [0.2, 0, 1]},
    },
    "lamps": [
        {"at": [0, -0.6, 1], "onto": "wall", "height": 0.4},
        {"at": [0, 0, 1.7], "onto": "floor", "height": 0.4},
    ],
}
QUICK = {"resolution": 64, "count": 12, "time_limit": 5.0, "width": 0.5}


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    path = tmp_path_factory.mktemp("room") / "room.json"
    path.write_text(json.dumps(ROOM))
    return path


@pytest.fixture(scope="module")
def heap(path):
    return rasp.sculpt(kitchen_like(4), text=["L", "T"], room=path, **QUICK)


def test_shadows_are_those_that_rays_find(heap):
    there = heap.in_room
    vertices, faces = there.surface
    square = {"middle": [0, 0.5, 1], "right": [1, 0, 0], "up": [0, 0, 1], "height": 0.4}
    cast = thrown(vertices + np.array([0, 0, 1]), faces, [0, -0.6, 1], **square, size=64)
    assert iou(cast, there.shadows[0]) > 0.97
    assert iou(cast, there.wanted[0]) == pytest.approx(there.likeness[0], abs=0.02)
    assert heap.table()["in the room"] == there.line()
    assert re.match(r"in the room: .* of their size; shadows .*% on the wall, .*% on the floor", there.line())


def test_it_is_saved_with_a_sheet_and_shown_in_its_room(heap, tmp_path):
    folder = heap.save(tmp_path / "run")
    record = json.loads((folder / "result.json").read_text())["room"]
    assert {key: record[key] for key in ROOM} == ROOM
    sheet = (folder / "room.html").read_text()
    assert "<td>x 0.000  y -0.600  z 1.000 m</td>" in sheet
    assert "1.100 m" in sheet  # from lamp to wall
    assert "11.3 degrees" in sheet  # of a floor that rises by 1 in 5
    picture = heap.in_room.picture(160)
    assert max(picture.shape[:2]) == 160
    assert np.array_equal(picture, heap.in_room.picture(160))


@pytest.mark.parametrize(
    ("asked", "says"),
    [
        ({"azimuths_deg": [0, 90]}, "a room says where lamps are; leave out azimuths"),
        ({"text": ["A", "B", "C"]}, "each of 3 pictures needs a lamp of its own, the room has 2"),
    ],
)
def test_what_does_not_go_with_a_room_is_said(path, asked, says):
    with pytest.raises(InputError, match=says):
        rasp.sculpt(kitchen_like(2), **{"text": ["A", "B"], "room": path} | asked)
    with pytest.raises(InputError, match="leave out azimuths"):
        room_for(path, 2, plain=False)


def test_the_command_says_where_its_sheet_is(path, tmp_path, capsys):
    body = kitchen_like(1)[0]
    few = ["--width", "0.5", "--resolution", "32", "--count", "1", "--out", str(tmp_path / "run")]
    (tmp_path / "part.obj").write_text(_obj(body))
    assert main(["art", str(tmp_path / "part.obj"), "--text", "L", "T", "--room", str(path), *few]) == 0
    assert "room.html: in the room: " in capsys.readouterr().out
    with Image.open(tmp_path / "run" / "silhouettes.png") as image:
        assert image.width > 0


def _obj(body):
    lines = [f"v {x} {y} {z}" for x, y, z in body.vertices]
    return "\n".join(lines + [f"f {a} {b} {c}" for a, b, c in body.faces + 1])
