"""What is dropped lies above what was there, and no nearer than is asked."""

import numpy as np
import pytest
import trimesh

from rasp_core.geometry.containers import FreeBox, box
from rasp_core.geometry.meshes import make_body
from rasp_core.packing import dropping
from rasp_core.packing.clearance import clearance_of
from rasp_core.packing.dropping import drop
from rasp_core.util.errors import InputError

TABLE = trimesh.util.concatenate(
    [trimesh.creation.box(bounds=b) for b in ([(0, 0, 0), (1, 4, 3)], [(0, 0, 3), (4, 4, 3.5)], [(3, 0, 0), (4, 4, 3)])]
)
CUBE = trimesh.creation.box((1, 1, 1))
POOL = [
    make_body("table", TABLE.vertices, TABLE.faces),
    *(make_body(f"cube{k}", CUBE.vertices, CUBE.faces) for k in range(9)),
]
THERE = trimesh.transformations.translation_matrix((-2, -2, -4))[None]


def boxes_of(found):
    return {i: np.array([POOL[i].placed(m).min(0), POOL[i].placed(m).max(0)]) for i, m in found}


@pytest.mark.parametrize("clearance", [None, 0.2])
def test_nothing_is_put_under_a_roof(clearance):
    asked = None if clearance is None else clearance_of(POOL, clearance)
    there = THERE if clearance is None else trimesh.transformations.translation_matrix((0, 0, 0.2)) @ THERE
    found, stay, room = drop(POOL, range(1, 10), [0], there, box((4.4, 4.4, 8)), asked)
    boxes = boxes_of(found)
    assert len(found) == 9
    assert np.array_equal(stay, there)
    assert room.size.tolist() == [4.4, 4.4, 8]
    for i, (low, high) in boxes.items():
        assert low[2] >= -0.5 + 2 * (clearance or 0) - 1e-9
        for j, (below, above) in boxes.items():
            assert i == j or np.maximum(low - above, below - high).max() >= (clearance or 0) - 1e-9
        assert (np.abs([low, high]).max(0) + (clearance or 0) <= np.array([2.2, 2.2, 4]) + 1e-9).all()


def test_a_box_that_is_sought_grows_until_all_are_in(monkeypatch):
    found, stay, room = drop(POOL, range(1, 10), [0], THERE, box((4, 4, 8)), None, FreeBox((4.0, 4.0, None)))
    assert (len(found), room.size.tolist()) == (9, [4, 4, 8]), "it is high enough"
    low = trimesh.transformations.translation_matrix((0, 0, 2)) @ THERE
    found, stay, room = drop(POOL, range(1, 10), [0], low, box((4, 4, 4)), None, FreeBox((4.0, 4.0, None)))
    assert len(found) == 9
    assert room.size[2] > 4.4
    assert stay[0, 2, 3] == pytest.approx(-room.size[2] / 2), "the table stays on the floor"
    monkeypatch.setattr(dropping, "MOST_GROWN", 2)
    with pytest.raises(InputError, match="not all objects find room above each other"):
        drop(POOL, range(1, 10), [0], low, box((4, 4, 4)), None, FreeBox((4.0, 4.0, None)))


def test_where_nothing_is_over_or_nothing_fits_all_stays():
    low = trimesh.transformations.translation_matrix((0, 0, 2)) @ THERE
    for over in ([], [1]):
        found, stay, _ = drop(POOL, over, [0], low, box((4, 4, 4)))
        assert found == []
        assert np.array_equal(stay, low)
