"""A heap made one piece, at the door: shown, described, saved with its run, in a room."""

import json

import numpy as np
import pytest
import trimesh
from rooms import ROOM

import rasp_core as rasp
from data_fetch import kitchen_like
from rasp_core.art.room_file import room_of
from rasp_core.util.errors import InputError

QUICK = {"resolution": 64, "count": 12, "time_limit": 5.0}


@pytest.fixture(scope="module")
def heap():
    return rasp.sculpt(kitchen_like(4), text=["L", "T"], width=0.5, **QUICK)


def test_it_is_shown_and_saved_with_its_run(heap, tmp_path):
    built = heap.build(printer_mm=(120, 120, 150), thickness_mm=1.5)
    assert built.standing.stands
    assert built.warnings == [*heap.warnings, *built.built.warnings]
    assert repr(built).startswith("<Built: one closed piece of ")
    assert built.table()["hidden struts"].endswith(", 1.5 mm thick at least")
    assert np.asarray(built.show((200, 200))).shape == (200, 200, 3)
    assert "data:image" in built._repr_html_()
    folder = built.save(tmp_path / "run")
    record = json.loads((folder / "result.json").read_text())
    assert record["build"]["standing"]["stands"]
    assert record["command"] == "art"
    for name in ("built.stl", "built.3mf"):
        mesh = trimesh.load(folder / name, force="mesh")
        assert mesh.is_watertight
        assert mesh.body_count == 1
        assert np.ptp(mesh.bounds, axis=0) == pytest.approx(record["build"]["size_mm"], abs=1e-3)
        assert (np.ptp(mesh.bounds, axis=0) <= np.array([120, 120, 150]) + 1e-3).all()


def test_in_a_room_a_piece_has_the_size_that_its_shadows_need():
    heap = rasp.sculpt(kitchen_like(4), text=["L", "T"], room=room_of(ROOM), width=0.5, **QUICK)
    built = heap.build(printer_mm=(300, 300, 300))
    without_base = built.built.size_mm - [0, 0, built.built.base_mm[2]]
    assert without_base[:2] == pytest.approx(1000 * heap.in_room.size[:2], abs=0.1)
    assert without_base[2] >= 1000 * heap.in_room.size[2] - 0.1
    with pytest.raises(InputError, match=r"the piece is .* mm and the printer's volume 50 x 300 x 300; make the"):
        heap.build(printer_mm=(50, 300, 300))


def test_a_base_does_not_stand_before_a_lamps_floor():
    lamps = [ROOM["lamps"][0], {"at": [0, 0, 1.6], "onto": "floor", "height": 0.4}]
    room = room_of(ROOM | {"lamps": lamps})
    heap = rasp.sculpt(kitchen_like(4), text=["L", "T"], room=room, width=0.5, **QUICK | {"count": 2})
    with pytest.raises(InputError, match=r"a base would stand between the lamp at \[0.0, 0.0, 1.6\] and the floor"):
        heap.build()
