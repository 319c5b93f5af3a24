"""Scenes as GLB: what cannot be read is named, and pages hold all that they need."""

import base64
import io
import re

import numpy as np
import pytest
import trimesh

from data_fetch import kitchen_like
from rasp_core.exact.certificate import certify
from rasp_core.geometry.containers import Container, box
from rasp_core.geometry.meshes import make_body, unique_names
from rasp_core.util.errors import InputError
from rasp_core.visualize import gltf


def test_scenes_that_cannot_be_used_are_named(tmp_path):
    with pytest.raises(InputError, match="no such scene"):
        gltf.read_scene(tmp_path / "gone.glb")
    (tmp_path / "bad.glb").write_bytes(b"glTF nonsense")
    with pytest.raises(InputError, match="rasp pack writes scenes"):
        gltf.read_scene(tmp_path / "bad.glb")
    cube, sheet = trimesh.creation.box(), trimesh.Trimesh(np.eye(3), [[0, 1, 2]])

    def scene(name, **nodes):
        made = trimesh.Scene()
        for node, mesh in nodes.items():
            made.add_geometry(mesh, node_name=node, geom_name=node)
        made.export(tmp_path / name)
        return tmp_path / name

    with pytest.raises(InputError, match="no node named container"):
        gltf.read_scene(scene("a.glb", thing=cube))
    with pytest.raises(InputError, match="no objects"):
        gltf.read_scene(scene("b.glb", container=cube))
    with pytest.raises(InputError, match=r"c\.glb: thing: .*open"):
        gltf.read_scene(scene("c.glb", thing=sheet, container=cube))


def test_a_page_holds_all_that_it_needs():
    bodies, matrices = kitchen_like(2), np.tile(np.eye(4), (2, 1, 1))
    text = gltf.page(bodies, matrices)
    assert not re.search(r'(src|href)="', text), "nothing is loaded from elsewhere"
    data = max(re.findall(r"[A-Za-z0-9+/=]{1000,}", text), key=lambda word: word.startswith("Z2xURg"))
    scene = trimesh.load_scene(io.BytesIO(base64.b64decode(data)), file_type="glb")
    assert set(scene.geometry) == {body.name for body in bodies}
    high = max(np.ptp(body.solid_vertices[:, 2]) for body in bodies)
    assert np.ptp(scene.bounds[:, 1]) >= 0.99 * high, "up is y in a page"
    frame = gltf.page(bodies, matrices, embedded=True)
    assert frame.startswith("<div><iframe srcdoc=")
    again = gltf.page_of(gltf.encode(bodies, matrices))
    assert all(made.count(gltf.LAMPS) == 1 for made in (text, frame, again)), "trimesh's page has its lamp no longer"


def hollow(edge, shift):
    outer, inner = (trimesh.creation.box((e,) * 3).apply_translation(shift) for e in (edge, edge / 2))
    vertices = np.concatenate([outer.vertices, inner.vertices])
    return vertices, np.concatenate([outer.faces, inner.faces[:, ::-1] + 8])


@pytest.mark.parametrize("edge", [1e-6, 0.1, 1e5])
@pytest.mark.parametrize("far", [0.0, 1e6])
def test_a_scene_read_back_is_what_was_written(tmp_path, edge, far):
    """Parts of micrometres and surveys far from the origin: as many objects, their volumes, the same certificate."""
    shift = np.array([1.0, -2.0, 3.0]) * far * edge
    ball = trimesh.creation.icosphere(subdivisions=2, radius=edge / 2).apply_translation(shift)
    names = ("container", "world", "ball", "ball")
    bodies = unique_names(
        [make_body(name, *(hollow(edge, shift) if name != "ball" else (ball.vertices, ball.faces))) for name in names]
    )
    turn = trimesh.transformations.rotation_matrix(0.3, (1, 2, 3), shift)
    matrices = np.stack([turn] * len(bodies))
    for k in range(len(bodies)):
        matrices[k, :3, 3] += shift + np.array([1.2 * k - (k == 3) * 0.7, 0, 0]) * edge
    room = trimesh.creation.box((7.3 * edge, 3 * edge, 3 * edge)).apply_translation(2 * shift + [1.5 * edge, 0, 0])
    container = Container(make_body("container", room.vertices, room.faces))
    written = certify(bodies, matrices, container)
    assert len(written.overlaps) == 1
    assert not written.protrusions
    gltf.write_scene(tmp_path / "scene.glb", bodies, matrices, container)
    back, inside = gltf.read_scene(tmp_path / "scene.glb")
    assert (
        {body.name for body in back} == {body.name for body in bodies} == {"container#2", "world#2", "ball", "ball#2"}
    )
    volume = {body.name: body.volume for body in back}
    assert [volume[body.name] for body in bodies] == pytest.approx([body.volume for body in bodies], rel=1e-5)
    assert inside.volume == pytest.approx(container.volume, rel=1e-5)
    read = certify(back, np.tile(np.eye(4), (len(back), 1, 1)), inside)
    assert read.holds == written.holds
    assert read.worst_overlap == pytest.approx(written.worst_overlap, abs=1e-5)


def test_a_box_is_read_back_as_a_container(tmp_path):
    gltf.write_scene(tmp_path / "scene.glb", kitchen_like(1), np.eye(4)[None], box((0.3, 0.2, 0.1)))
    assert gltf.read_scene(tmp_path / "scene.glb")[1].volume == pytest.approx(0.006)
