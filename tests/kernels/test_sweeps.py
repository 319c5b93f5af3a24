"""What a solid sweeps over, against exact booleans of a union of prisms."""

import manifold3d
import numpy as np
import pytest
import trimesh

from data_fetch import kitchen_like
from rasp_core.kernels.sweeps import facing_up, swept

UP = np.array([0, 0, 1.0])


def corners_of(body, generator, middle=(0, 0, 0)):
    turn = trimesh.transformations.random_rotation_matrix(generator.random(3))[:3, :3]
    vertices = body.solid_vertices @ turn.T + middle
    return vertices, in_order(vertices[body.solid_faces])


def in_order(corners):
    return corners[np.argsort(corners[:, :, 0].min(1))]


def by_booleans(lower, vertices, faces):
    """Volume of a solid in the union of the prisms that stand on triangles."""
    prisms = [manifold3d.Manifold.hull_points(np.concatenate([corners, corners + UP])) for corners in lower]
    union = manifold3d.Manifold.batch_boolean(prisms, manifold3d.OpType.Add)
    return (union ^ manifold3d.Manifold(manifold3d.Mesh64(vertices, faces.astype(np.uint64)))).volume()


@pytest.mark.parametrize("seed", range(6))
def test_it_is_the_volume_in_prisms_on_the_underside(seed):
    generator, bodies = np.random.default_rng(seed), kitchen_like(8)
    one, other = (bodies[k] for k in generator.choice(8, 2))
    _, moving = corners_of(one, generator)
    vertices, still = corners_of(other, generator, generator.uniform(-0.05, 0.05, 3) + 0.03 * UP)
    lower, facing = moving[facing_up(moving) < 0], facing_up(still)
    found = swept(lower, still[facing != 0], facing[facing != 0], np.inf)
    true = by_booleans(lower, vertices, other.solid_faces)
    assert true > 1e-6
    assert found >= true * (1 - 1e-9), "layers of an underside above each other count each"
    if one.manifold.hull().volume() < one.volume * (1 + 1e-9):
        assert found == pytest.approx(true, rel=1e-9)
    assert np.isinf(swept(lower, still[facing != 0], facing[facing != 0], true / 2))


def cube(low, high):
    box = trimesh.creation.box(bounds=[low, high])
    corners = in_order(np.array(box.triangles))
    facing = facing_up(corners)
    return corners[facing != 0], facing[facing != 0]


@pytest.mark.parametrize(
    ("low", "high", "volume"),
    [
        ((0, 0, 2), (1, 1, 3), 1.0),  # above
        ((0, 0, -2), (1, 1, -1), 0.0),  # below
        ((0, 0, 0.5), (1, 1, 1.5), 1.0),  # reaches into it
        ((1, 0, 2), (2, 1, 3), 0.0),  # beside it, side on side
        ((0.75, 0.5, 2), (2, 3, 2.5), 0.0625),  # across an edge
        ((0, 0, -1), (1, 1, 0), 0.0),  # beneath, face on face
        ((0, 0, -1), (1, 1, 0.1), 0.1),  # beneath, a little too high
    ],
)
def test_cubes(low, high, volume):
    corners, facing = cube((0, 0, 0), (1, 1, 1))
    found = swept(corners[facing < 0], *cube(low, high), np.inf)
    assert found == pytest.approx(volume, abs=1e-12)


def test_triangles_face_up_or_down_or_are_seen_as_lines():
    corners = np.array(
        [[[0, 0, 0], [1, 0, 0], [0, 1, 5]], [[0, 0, 0], [0, 1, 5], [1, 0, 0]], [[0, 0, 0], [1, 0, 0], [1, 0, 1]]]
    )
    assert facing_up(corners.astype(float)).tolist() == [1, -1, 0]
