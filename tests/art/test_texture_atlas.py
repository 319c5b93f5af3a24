"""The atlas against colours that are linear over each triangle, which it must hold and give back exactly."""

import numpy as np
import pytest

from rasp_core.art.texture_atlas import Atlas

STEPS = np.array([1, 5, 2, 2, 9, 1, 5, 3])


@pytest.fixture
def atlas():
    return Atlas.of(STEPS)


def linear(face, u, v):
    """A colour that differs from triangle to triangle and is linear in each."""
    return np.stack([0.1 * face / 8 + 0.4 * u, 0.3 * v + 0.2, 0.5 - 0.2 * u + 0.3 * v], -1)


def test_blocks_lie_in_the_texture_and_apart(atlas):
    owner = np.full((atlas.size, atlas.size), -1)
    for face, ((row, column), n) in enumerate(zip(atlas.corner, STEPS, strict=True)):
        block = owner[row : row + n + 1, column : column + n + 1]
        assert block.shape == (n + 1, n + 1)
        assert (block == -1).all()
        block[:] = face


def test_texels_are_numbered_one_after_the_other(atlas):
    face, i, j = atlas.lattice
    assert np.array_equal(atlas.number(face, i, j), np.arange(atlas.first[-1]))
    assert (i + j <= STEPS[face]).all()
    assert len(set(zip(face, i, j, strict=True))) == len(face)


def test_points_get_the_colour_of_their_place(atlas):
    face, i, j = atlas.lattice
    colours = linear(face, i / STEPS[face], j / STEPS[face])
    random = np.random.default_rng(0)
    at = random.integers(len(STEPS), size=500)
    u, v = random.random((2, 500))
    u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    texels, weights = atlas.weights(at, u, v)
    assert np.allclose(weights.sum(1), 1)
    assert weights.min() > -1e-9
    assert np.allclose((colours[texels] * weights[..., None]).sum(1), linear(at, u, v))


def test_a_bilinear_viewer_sees_the_same(atlas):
    face, i, j = atlas.lattice
    image = atlas.texture(linear(face, i / STEPS[face], j / STEPS[face])) / 255.0
    random = np.random.default_rng(1)
    at = random.integers(len(STEPS), size=300)
    u, v = random.random((2, 300))
    u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    corners = atlas.uv[at]
    place = corners[:, 0] + u[:, None] * (corners[:, 1] - corners[:, 0]) + v[:, None] * (corners[:, 2] - corners[:, 0])
    x, y = place[:, 0] * atlas.size - 0.5, (1 - place[:, 1]) * atlas.size - 0.5
    column, row = np.floor(x + 1e-9).astype(int), np.floor(y + 1e-9).astype(int)
    fx, fy = (x - column)[:, None], (y - row)[:, None]
    right, below = np.minimum(column + 1, atlas.size - 1), np.minimum(row + 1, atlas.size - 1)
    upper = image[row, column] * (1 - fx) + image[row, right] * fx
    lower = image[below, column] * (1 - fx) + image[below, right] * fx
    assert np.allclose(upper * (1 - fy) + lower * fy, linear(at, u, v), atol=0.006)


def test_edges_join_each_pair_of_neighbours_once(atlas):
    pairs = {tuple(sorted(pair)) for pair in atlas.edges()}
    assert len(pairs) == len(atlas.edges()) == (3 * STEPS * (STEPS + 1) // 2).sum()
    face, i, j = atlas.lattice
    a, b = atlas.edges().T
    assert np.array_equal(face[a], face[b])
    step = np.abs(i[a] - i[b]) + np.abs(j[a] - j[b])
    assert step.max() <= 2
