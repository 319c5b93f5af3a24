"""Heaps made one piece: read back and measured by trimesh, looked at by rays."""

import numpy as np
import pytest
import torch
import trimesh
from heaps import SIDES, SIZE, heap
from manifold3d import JoinType, Manifold
from oracles import cast_mask, iou

from rasp_core.art import building
from rasp_core.art.building import _apart, _printable, build, check_printer
from rasp_core.geometry.cameras import Camera
from rasp_core.geometry.meshes import make_body
from rasp_core.geometry.shells import to_manifold
from rasp_core.silhouettes import likeness
from rasp_core.util.errors import InputError


def column(count=2):
    """The pictures of a column of half the height, a quarter of the width."""
    pictures = np.zeros((count, SIZE, SIZE), bool)
    pictures[:, 32:96, 48:80] = True
    return pictures


@pytest.fixture(autouse=True, scope="module")
def coarsely():
    """Struts are sought on a coarser lattice."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(building, "LATTICE", 50)
        yield


@pytest.fixture(scope="module")
def pillar():
    """Three cubes of edge 0.15 above each other, 0.015 apart, and 0.01 above where the picture ends."""
    mesh = trimesh.creation.box([0.15] * 3)
    return heap([(0.01, 0, -0.165), (0, 0.01, 0.0), (0, 0, 0.165)], column(), mesh=mesh)


@pytest.fixture(scope="module")
def built(pillar):
    return build(pillar, printer_mm=(100, 100, 160), thickness_mm=2.5)


def test_it_is_one_closed_piece_of_the_printers_size(built):
    mesh = trimesh.Trimesh(built.vertices, built.faces)
    assert mesh.is_watertight
    assert mesh.body_count == 1
    assert mesh.is_winding_consistent
    assert mesh.bounds[0, 2] == pytest.approx(0, abs=1e-4)
    assert np.ptp(mesh.bounds, axis=0)[2] == pytest.approx(160, abs=0.01)
    cubes, base = 3 * (0.15 * built.scale) ** 3, np.prod(built.base_mm)
    assert built.base_mm[2] == pytest.approx(5)
    assert 0 < mesh.volume - cubes - base < 0.1 * cubes  # the struts
    assert built.to_dict()["volume_mm3"] == pytest.approx(mesh.volume)


def test_joints_are_as_thick_as_asked(built):
    solid = to_manifold(built.vertices, built.faces)
    for z in (-0.0825, 0.0825):  # between two cubes
        cut = solid.slice(z * built.scale + built.shift[2])
        assert not cut.offset(-1.24, JoinType.Round).is_empty()  # a disc of that radius is in it


def test_struts_are_not_seen(pillar, built):
    vertices = (built.vertices - built.shift) / built.scale
    whole = make_body("built", vertices, built.faces)
    turn, shift = torch.eye(3, dtype=torch.float64)[None], torch.tensor(whole.centre[None])
    for k, camera in enumerate(SIDES):
        seen = cast_mask([whole], turn, shift, camera, SIZE)
        seen[96:] = False  # below the picture
        assert (seen ^ built.images[k]).sum() <= 8  # corners of cubes, less than half of whose pixels is covered
        assert not (seen & ~pillar.hull[k] & ~(pillar.images[k] > 0.5)).any()
        assert iou(seen, pillar.pictures[k]) == pytest.approx(built.likeness[k], abs=0.005)
    assert (built.of_ceiling > pillar.of_ceiling).all()  # they are where it was to be dark


def test_what_it_says(built):
    assert built.line().startswith("one closed piece of ")
    assert " x 160 mm, " in built.line()
    assert built.warnings == []
    assert built.names == ["cube", "cube#2", "cube#3", "base"]
    assert {(s.first, s.second) for s in built.struts} >= {(0, 1), (1, 2)}


def test_cavities_are_filled_and_thin_walls_named(built):
    outer, inner = trimesh.creation.box([0.2] * 3), trimesh.creation.box([0.19] * 3)
    inner.invert()
    hollow = trimesh.util.concatenate([outer, inner])
    open_ = trimesh.boolean.difference([outer, trimesh.creation.box([0.19, 0.19, 0.25])], engine="manifold")
    filled = build(heap([(0, 0, -0.12), (0, 0, 0.12)], column(), mesh=hollow))
    assert filled.to_dict()["volume_mm3"] > 2 * (0.2 * filled.scale) ** 3
    assert filled.warnings == []
    (line,) = build(heap([(0, 0, -0.12), (0, 0, 0.12)], column(), mesh=open_), thickness_mm=4).warnings
    assert line.startswith("walls are thinner than 4 mm behind ")


def test_a_shadow_from_above_falls_on_the_base():
    views = [*SIDES, Camera(0, 90, 1.0)]
    pictures = column(3)
    pictures[2] = False
    pictures[2, 48:80, 48:80] = True
    made = build(heap([(0, 0, -0.12), (0, 0, 0.12)], pictures, views))
    assert made.base_mm[0] == pytest.approx(0.2 * made.scale)
    assert (made.of_ceiling >= likeness(made.sculpture.images > 0.5, made.sculpture.hull)).all()


def test_where_a_picture_ends_in_a_tip_the_base_is_higher():
    pictures = column()
    for row in range(88, 96):  # a wedge, down to a pixel's width
        narrow = (row - 87) * 2
        pictures[:, row, :] = False
        pictures[:, row, 48 + narrow : 80 - narrow] = True
    pictures[:, 96:99, 64] = True  # too thin for a strut
    made = build(heap([(0, 0, -0.11), (0, 0, 0.11)], pictures), thickness_mm=3)
    assert trimesh.Trimesh(made.vertices, made.faces).body_count == 1
    last = [np.flatnonzero(image.any(1))[-1] for image in made.images]
    assert all(90 <= row < 98 for row in last)


def test_what_no_hidden_strut_joins_is_named_in_one_line():
    pictures = column()
    pictures[:, 60:68] = False  # light between two dark squares
    with pytest.raises(InputError, match=r"^struts impossible: none of 2 mm that no view sees reaches cube#2; ask for"):
        build(heap([(0, 0, -0.14), (0, 0, 0.14)], pictures))


def test_what_touches_along_an_edge_is_closed_when_it_is_read():
    cubes = Manifold.cube([1, 1, 1]) + Manifold.cube([1, 1, 1]).translate([1, 1, 0])
    bridge = Manifold.cube([2, 2, 0.2]).translate([0, 0, 0.9])  # so that they are one piece
    vertices, faces = _printable(cubes + bridge)
    mesh = trimesh.Trimesh(vertices.astype(np.float32), faces)
    assert mesh.is_watertight
    assert mesh.body_count == 1
    assert mesh.volume == pytest.approx((cubes + bridge).volume(), rel=1e-2)
    same = _apart(np.zeros((5, 3), np.float32))
    assert len(np.unique(same, axis=0)) == 5
    assert np.abs(same).max() < 0.01


def test_two_pieces_are_no_piece():
    cube = Manifold.cube([1, 1, 1])
    assert len(_printable(cube)[1]) == 12
    with pytest.raises(InputError, match=r"does not become one closed piece \(2 pieces\)"):
        _printable(cube + cube.translate([3, 0, 0]))


@pytest.mark.parametrize(
    ("asked", "says"),
    [
        ({"printer_mm": (200, 200)}, "three positive lengths in mm, got"),
        ({"printer_mm": (200, 200, 0)}, "three positive lengths in mm, got"),
        ({"printer_mm": (200, 200, np.inf)}, "three positive lengths in mm, got"),
        ({"thickness_mm": 0}, "thicker than 0 and thinner than a tenth of the printer's 200 mm, got 0 mm"),
        ({"thickness_mm": 30}, "thinner than a tenth"),
    ],
)
def test_lengths_make_sense(asked, says):
    with pytest.raises(InputError, match=says):
        check_printer(**asked)
