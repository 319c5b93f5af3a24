"""What vessels hold, against volumes counted by hand."""

import numpy as np
import pytest
import trimesh

from data_fetch import torus
from rasp_core.geometry.cavities import cavity, describe_wall, wall_thickness
from rasp_core.geometry.containers import cavity_of, parse
from rasp_core.geometry.meshes import make_body
from rasp_core.util.errors import MeshError


def vessel(outer, inner, shift=(0, 0, 0)):
    """A box with a box cut out of it."""
    walls = trimesh.creation.box(outer)
    hole = trimesh.creation.box(inner).apply_translation(shift)
    mesh = trimesh.boolean.difference([walls, hole], engine="manifold")
    return make_body("vessel", mesh.vertices, mesh.faces)


@pytest.mark.parametrize(
    ("outer", "inner", "shift", "volume"),
    [
        ((1, 1, 1), (0.9, 0.9, 0.95), (0, 0, 0.05), 0.9 * 0.9 * 0.925),
        ((1, 1, 1), (0.9, 0.9, 2), (0, 0, 0), 0.81),
        ((1, 1, 1), (0.9, 0.9, 0.9), (0, 0, 0), 0.729),
    ],
    ids=["open at the top", "open at both ends", "sealed"],
)
def test_what_a_vessel_holds(outer, inner, shift, volume):
    body = vessel(outer, inner, shift)
    inside = cavity(body)
    assert inside.volume == pytest.approx(volume)
    assert (inside.manifold.translate(inside.centre) ^ body.manifold.translate(body.centre)).volume() < 1e-9
    assert describe_wall(body).endswith("say --cavity")


def test_what_is_no_cavity():
    box = trimesh.creation.box()
    assert cavity(make_body("block", box.vertices, box.faces)) is None
    assert cavity(torus(0.15, 0.06)) is None
    assert describe_wall(torus(0.15, 0.06)) is None
    assert describe_wall(vessel((1, 1, 1), (0.3, 0.3, 0.3))) is None, "a thick wall about a small void"


def test_a_thin_wall_is_half_its_volume_over_its_area():
    assert wall_thickness(vessel((1, 1, 1), (0.98, 0.98, 0.98))) == pytest.approx(0.01, rel=0.01)


def test_a_vessels_file_as_a_container(tmp_path):
    body = vessel((1, 1, 1), (0.9, 0.9, 2))
    mesh = trimesh.Trimesh(body.vertices, body.faces, process=False)
    mesh.export(tmp_path / "pipe.stl")
    assert parse(f"cavity:{tmp_path / 'pipe.stl'}").volume == pytest.approx(0.81, rel=1e-6)
    assert parse(str(tmp_path / "pipe.stl")).volume == pytest.approx(0.19, rel=1e-6)
    trimesh.creation.box().export(tmp_path / "block.stl")
    with pytest.raises(MeshError, match=r"block\.stl: has no cavity; leave out --cavity"):
        cavity_of(tmp_path / "block.stl")


@pytest.mark.filterwarnings("ignore::rasp_core.util.errors.MeshWarning")
def test_a_cup_without_thickness_holds_what_is_below_its_rim(tmp_path):
    box = trimesh.creation.box((1, 1, 1))
    cup = box.submesh([np.flatnonzero(box.face_normals[:, 2] < 0.5)])[0]
    cup.export(tmp_path / "cup.stl")
    assert cavity_of(tmp_path / "cup.stl").volume == pytest.approx(1)
