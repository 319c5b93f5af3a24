"""Pools of the figures: sizes, and files that hold the same solids."""

import pytest

import rasp_core as rasp
from data_fetch import kitchen_like
from rasp_core.reproduce.pools import as_files, resized


def test_longest_edges_are_six_to_twelve_centimetres_and_shapes_stay():
    bodies = kitchen_like(5)
    found = resized(bodies)
    edges = [2 * body.half_extents.max() for body in found]
    assert 0.06 <= min(edges) < max(edges) <= 0.12
    for one, before in zip(found, bodies, strict=True):
        scale = one.half_extents / before.half_extents
        assert scale == pytest.approx([scale[0]] * 3)
        assert one.volume == pytest.approx(before.volume * scale[0] ** 3)
    assert [2 * body.half_extents.max() for body in resized(bodies)] == edges
    assert [2 * body.half_extents.max() for body in resized(bodies, seed=1)] != edges


@pytest.mark.parametrize(("divided", "times"), [(False, 1), (True, 4)])
def test_files_hold_the_same_solids(tmp_path, divided, times):
    bodies = kitchen_like(3)
    found = {body.name: body for body in rasp.load(*as_files(bodies, tmp_path / "pool", divided))}
    assert found.keys() == {body.name for body in bodies}
    for body in bodies:
        assert len(found[body.name].faces) == times * len(body.faces)
        assert found[body.name].volume == pytest.approx(body.volume, rel=1e-5)
