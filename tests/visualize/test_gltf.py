"""Scenes as GLB: what cannot be read is named, and pages hold all that they need."""

import base64
import io
import re

import numpy as np
import pytest
import trimesh

from data_fetch import kitchen_like
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
