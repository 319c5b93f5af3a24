"""What shells bound, against volumes counted by hand."""

import numpy as np
import pytest
import trimesh

from rasp_core.geometry.shells import is_closed, mates, split, to_manifold, unite
from rasp_core.util.errors import MeshError

CUBE = trimesh.creation.box((1, 2, 3))


def cube(edge, at=(0, 0, 0), inward=False):
    mesh = trimesh.creation.box((edge,) * 3)
    return np.asarray(mesh.vertices) + at, np.asarray(mesh.faces)[:, ::-1] if inward else np.asarray(mesh.faces)


def joined(*parts):
    first = np.cumsum([0, *(len(v) for v, _ in parts)])
    return np.concatenate([v for v, _ in parts]), np.concatenate(
        [f + k for (_, f), k in zip(parts, first, strict=False)]
    )


def welded(vertices, faces):
    mesh = trimesh.Trimesh(vertices, faces, process=True)
    return np.asarray(mesh.vertices), np.asarray(mesh.faces)


def test_touching_pieces_lose_their_inner_faces():
    solid, notes = unite(*joined(cube(1), cube(1, (1, 0, 0))))
    assert (solid.volume(), solid.surface_area(), notes) == (pytest.approx(2), pytest.approx(10), [])


@pytest.mark.parametrize(
    ("shells", "volume", "said"),
    [
        ([cube(10), cube(4, inward=True)], 936, False),
        ([cube(10), cube(4)], 936, True),
        ([cube(10), cube(4, inward=True), cube(1)], 937, False),
        ([cube(10, inward=True), cube(4)], 936, False),
        ([cube(10), cube(2, (20, 0, 0), inward=True)], 1008, True),
        ([cube(2, (20, 0, 0)), cube(10, inward=True)], 1008, True),
        ([cube(10), cube(2, (5, 0, 0))], 1004, False),
        ([cube(10), cube(2, (4, 0, 0))], 1000, False),
        ([cube(10), cube(10, (5, 0, 0)), cube(1)], 1500, True),
        ([cube(10), cube(2, (5, 0, 0), inward=True)], 996, False),
    ],
    ids=[
        "cavity",
        "cavity wound like the outside",
        "loose solid in a cavity",
        "all inside out",
        "inside out beside a larger one",
        "inside out and the larger one",
        "overlapping",
        "touching the wall from within",
        "within two that overlap",
        "a notch",
    ],
)
def test_solids_and_cavities_by_their_place(shells, volume, said):
    solid, notes = unite(*joined(*shells))
    assert solid.volume() == pytest.approx(volume)
    assert bool(notes) == said


def test_cubes_that_share_an_edge_are_two_shells():
    vertices, faces = welded(*joined(cube(1), cube(1, (1, 1, 0))))
    assert len(vertices) == 14
    found = split(vertices, faces)
    assert [len(group) for group in found] == [12, 12]
    assert unite(vertices, faces)[0].volume() == pytest.approx(2)


def test_about_a_crowded_edge_each_face_meets_the_other_side_of_its_solid():
    vertices, faces = welded(*joined(cube(1), cube(1, (1, 1, 0))))
    mate, count = mates(vertices, faces), len(faces)
    assert (mate >= 0).all()
    assert (mate[mate] == np.arange(3 * count)).all()
    centre = vertices[faces].mean(1)
    own = centre[:, :2].sum(1) > 1  # which cube a face is of
    assert (own[np.arange(3 * count) % count] == own[mate % count]).all()


def test_an_open_edge_has_no_mate():
    assert (mates(CUBE.vertices, CUBE.faces[1:]) < 0).sum() == 3
    assert not is_closed(CUBE.faces[1:])
    assert not is_closed(np.zeros((0, 3), int))


def test_to_manifold_refuses_an_open_surface():
    with pytest.raises(MeshError, match="not closed"):
        to_manifold(CUBE.vertices, CUBE.faces[1:])
