"""Things that are cut have the volume that is left, closed cuts, and stand on the table."""

import numpy as np
import pytest
import trimesh

from data_fetch import head, kitchen_like
from rasp_core.geometry.containers import Container, box
from rasp_core.visualize import studio
from rasp_core.visualize.studio import Knife

UPRIGHT = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])


def at(*places):
    matrices = np.tile(np.eye(4), (len(places), 1, 1))
    matrices[:, :3, 3] = places
    return matrices


def volume(surfaces):
    """Of the solid that surfaces close together."""
    corners = np.concatenate([surface.vertices[surface.faces] for surface in surfaces])
    return float(np.einsum("fi,fi->f", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6)


@pytest.mark.parametrize("turn", [None, UPRIGHT])
def test_a_cut_leaves_what_lies_behind_the_plane_and_closes_it(turn):
    bodies = kitchen_like(3)
    matrices = at(*(-body.centre for body in bodies))
    rotation = np.eye(3) if turn is None else turn
    for k, body in enumerate(bodies):
        knife = Knife((0.3, -2.0, 0.5), (0.0, 0.002, 0.001))
        left = studio.cut([body], matrices[k : k + 1], knife, turn)
        mesh = trimesh.Trimesh(body.solid_vertices @ rotation.T, body.solid_faces, process=False)
        inside = mesh.sample(4000)
        beyond = (inside - knife.point) @ np.asarray(knife.normal)
        for surface in left:
            assert ((surface.vertices - knife.point) @ np.asarray(knife.normal) < 1e-9).all()
        other = studio.cut([body], matrices[k : k + 1], Knife(-np.asarray(knife.normal), knife.point), turn)
        assert beyond.min() < 0 < beyond.max()
        assert volume(left) + volume(other) == pytest.approx(body.volume, rel=1e-6)
        assert len(left) == len(other) == 2


def test_what_a_knife_misses_is_whole_and_what_it_takes_is_gone():
    bodies, matrices = kitchen_like(1), at(-kitchen_like(1)[0].centre)
    (kept,) = studio.cut(bodies, matrices, Knife((1, 0, 0), (1.0, 0, 0)))
    assert volume([kept]) == pytest.approx(bodies[0].volume, rel=1e-6)
    assert studio.cut(bodies, matrices, Knife((1, 0, 0), (-1.0, 0, 0))) == []


def test_a_cut_container_is_open_with_a_line_along_the_cut():
    room = Container(head())
    (closed,) = studio.shell(room)
    assert volume([closed]) == pytest.approx(room.volume, rel=1e-6)
    knife = Knife((1, 0, 0), room.bounds.mean(0))
    wall, *rods = studio.shell(room, None, knife)
    assert wall.vertices[np.unique(wall.faces), 0].max() <= knife.point[0] + 1e-9
    assert not trimesh.Trimesh(wall.vertices, wall.faces, process=False).is_watertight
    assert len(rods) > 20
    assert all(abs(rod.vertices[:, 0].mean() - knife.point[0]) < 0.01 for rod in rods)


def test_a_set_stands_on_the_table_apart():
    bodies = kitchen_like(20)
    matrices = studio.set_out(bodies)
    placed = [body.placed(matrix) for body, matrix in zip(bodies, matrices, strict=True)]
    assert np.allclose([points[:, 2].min() for points in placed], 0)
    lows, highs = (np.array([f(points[:, :2], 0) for points in placed]) for f in (np.min, np.max))
    for i in range(20):
        for j in range(i):
            assert ((lows[i] >= highs[j] - 1e-9) | (lows[j] >= highs[i] - 1e-9)).any()


def test_a_pedestal_carries_what_stands_on_it():
    thing = studio.shell(Container(head()))
    foot = studio.pedestal(thing, high=0.25)
    points = thing[0].vertices
    assert foot.vertices[:, 2].max() == pytest.approx(points[:, 2].min())
    assert np.ptp(foot.vertices[:, 2]) == pytest.approx(0.25 * np.ptp(points[:, 2]))


def test_pictures_are_drawn_on_white():
    room, bodies = box((0.3, 0.3, 0.3)), kitchen_like(2)
    matrices = at(*((0.12 * k - 0.06, 0, 0) - body.centre for k, body in enumerate(bodies)))
    pictures = [studio.in_box(bodies, matrices, room, 160), *studio.stages(room, bodies, matrices, size=160, foot=True)]
    for picture in pictures:
        assert picture.dtype == np.uint8
        assert max(picture.shape) in (160, 360)
        assert (picture[:3].min(-1) > 235).mean() > 0.5
    for picture in (pictures[0], pictures[2]):
        assert (np.ptp(picture.astype(int), axis=2) > 60).mean() > 0.01
