"""Straight pulls free what is loose, and not what interlocks."""

import numpy as np
import pytest
import trimesh

from rasp_core.geometry.meshes import make_body
from rasp_core.physics import disassembly
from rasp_core.util.errors import InputError


def body(name, mesh):
    return make_body(name, mesh.vertices, mesh.faces)


def at(*places):
    matrices = np.tile(np.eye(4), (len(places), 1, 1))
    matrices[:, :3, 3] = places
    return matrices


BLOCK = body("block", trimesh.creation.box((1, 1, 1)))


def test_a_stack_comes_off_from_the_top():
    bodies = [body(name, trimesh.creation.box((1, 1, 1))) for name in ("low", "middle", "top")]
    found = disassembly.remove_all(bodies, at((0, 0, 0), (0, 0, 1), (0, 0, 2)), pulls=np.array([[0.0, 0, 1]]))
    assert [name for name, _ in found.order] == ["top", "middle", "low"]
    assert not found.stuck
    assert found.to_dict()["order"][0] == {"name": "top", "pull": [0, 0, 1]}


def test_what_is_locked_in_stays():
    """A ball in a closed shell, a shell that nothing holds."""
    shell = trimesh.boolean.difference([trimesh.creation.box((3, 3, 3)), trimesh.creation.box((2, 2, 2))])
    bodies = [body("shell", shell), body("ball", trimesh.creation.icosphere(radius=0.5))]
    found = disassembly.remove_all(bodies, at((0, 0, 0), (0, 0, 0)))
    assert sorted(found.stuck) == ["ball", "shell"]
    assert not found.order


def test_links_of_a_chain_interlock_and_rings_side_by_side_do_not():
    ring = trimesh.creation.torus(1.0, 0.2)
    link = ring.copy().apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, (1, 0, 0)))
    bodies = [body("ring", ring), body("link", link)]
    assert len(disassembly.remove_all(bodies, at((0, 0, 0), (1, 0, 0))).stuck) == 2
    assert not disassembly.remove_all(bodies, at((0, 0, 0), (3, 0, 0))).stuck


def test_a_drawer_has_one_way_out():
    frame = trimesh.boolean.difference(
        [
            trimesh.creation.box((2, 2, 2)),
            trimesh.creation.box((1, 2, 1), trimesh.transformations.translation_matrix((0, 0.5, 0))),
        ]
    )
    bodies = [body("frame", frame), body("drawer", trimesh.creation.box((0.98, 1.4, 0.98)))]
    found = disassembly.remove_all(bodies, at((0, 0, 0), (0, 0.25, 0)))
    assert not found.stuck
    name, pull = found.order[0]
    assert (name, pull) in [("drawer", [0, 1, 0]), ("frame", [0, -1, 0])]


def test_pulls_come_with_their_opposites():
    pulls = disassembly.spread_pulls()
    assert pulls.shape == (disassembly.PULLS, 3)
    assert np.linalg.norm(pulls, axis=1) == pytest.approx(1)
    assert np.allclose(pulls[::2], -pulls[1::2])
    assert pulls[0].tolist() == [0, 0, 1]
    assert np.abs(pulls @ pulls.T - np.eye(len(pulls))).max() <= 1 + 1e-9


def test_too_few_rays_are_refused():
    with pytest.raises(InputError, match="2 rays"):
        disassembly.remove_all([BLOCK], at((0, 0, 0)), rays=1)


def test_one_alone_is_taken_out_by_the_first_pull():
    found = disassembly.remove_all([BLOCK], at((0, 0, 0)))
    assert found.order == [("block", [0, 0, 1])]
    assert not found.stuck
    assert disassembly.remove_all([BLOCK], at((0, 0, 0)), pulls=np.zeros((0, 3))).stuck == ["block"]


def test_what_the_certificate_tolerates_holds_nothing_together():
    """Neighbours that share a ten thousandth of their volume: a row of cubes with a skin in common, and two balls."""
    skin = 0.5e-4
    row = [body(name, trimesh.creation.box((1, 1, 1))) for name in "abc"]
    assert not disassembly.remove_all(row, at((0, 0, 0), (1 - skin, 0, 0), (2 - 2 * skin, 0, 0))).stuck
    balls = [body(name, trimesh.creation.icosphere(subdivisions=4)) for name in "ab"]
    assert not disassembly.remove_all(balls, at((0, 0, 0), (1.98, 0.1, 0.05))).stuck


def test_what_shares_more_than_that_stays_together():
    shell = trimesh.boolean.difference([trimesh.creation.box((3, 3, 3)), trimesh.creation.box((2, 2, 2))])
    bodies = [body("shell", shell), body("core", trimesh.creation.box((2.01, 1, 1)))]
    assert len(disassembly.remove_all(bodies, at((0, 0, 0), (0, 0, 0))).stuck) == 2
