"""Exported parts, read back by the kit's own readers and by trimesh."""

import csv

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from rasp_core.geometry.loading import load_parts
from rasp_core.io import exports
from rasp_core.util.errors import InputError


@pytest.fixture
def placed():
    """Two copies of a cone and a block whose file lies far from its origin, turned and moved."""
    cone, block = trimesh.creation.cone(0.02, 0.05), trimesh.creation.box((0.03, 0.02, 0.01))
    found = []
    for k, (name, mesh, centre) in enumerate([("cone", cone, 0), ("cone#2", cone, 0), ('a "block" & <co>', block, 7)]):
        pose = np.eye(4)
        pose[:3, :3] = Rotation.from_rotvec([0.3 * k, 1 + k, -0.4]).as_matrix()
        pose[:3, 3] = (0.1 * k, -0.2, 0.05 / 3)
        matrix = pose.copy()
        matrix[:3, 3] -= pose[:3, :3] @ np.full(3, centre)
        found.append(exports.PlacedPart(name, f"{name}.stl", id(mesh), mesh.vertices, mesh.faces, pose, matrix))
    return found


def places(part):
    return part.vertices @ part.pose[:3, :3].T + part.pose[:3, 3]


def test_a_3mf_has_a_named_object_for_each_part_in_its_place(placed, tmp_path):
    exports.write_3mf(tmp_path / "parts.3mf", placed)
    bodies = load_parts(tmp_path / "parts.3mf")
    assert [body.name for body in bodies] == ["parts.cone", "parts.cone_2", 'parts.a "block" & <co>']
    scene = trimesh.load_scene(tmp_path / "parts.3mf")
    assert sorted(scene.graph.nodes_geometry) == ['a "block" & <co>', "cone", "cone_1"]
    assert len(scene.geometry) == 2, "copies share one mesh"
    for body, part in zip(bodies, placed, strict=True):
        assert body.vertices == pytest.approx(places(part), abs=1e-9)
    corners = np.concatenate([mesh.vertices for mesh in scene.dump()]) / 1000
    every = np.concatenate([places(part) for part in placed])
    assert corners.min(0) == pytest.approx(every.min(0), abs=1e-6)
    assert corners.max(0) == pytest.approx(every.max(0), abs=1e-6)


def test_an_stl_holds_all_in_millimetres(placed, tmp_path):
    exports.write_stl(tmp_path / "parts.stl", placed)
    mesh = trimesh.load(tmp_path / "parts.stl")
    expected = np.concatenate([places(part)[part.faces] for part in placed])
    assert mesh.triangles / 1000 == pytest.approx(expected, abs=1e-6)
    volume = sum(trimesh.Trimesh(places(part), part.faces).volume for part in placed)
    assert mesh.volume / 1e9 == pytest.approx(volume, rel=1e-5)
    assert trimesh.util.unitize(mesh.face_normals) == pytest.approx(
        trimesh.Trimesh(
            expected.reshape(-1, 3), np.arange(3 * len(expected)).reshape(-1, 3), process=False
        ).face_normals,
        abs=1e-4,
    )


def test_a_csv_has_the_poses_as_matrices_and_quaternions(placed, tmp_path):
    exports.write_csv(tmp_path / "parts.csv", placed)
    with (tmp_path / "parts.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [(row["name"], row["copy"]) for row in rows] == [("cone", "1"), ("cone#2", "2"), ('a "block" & <co>', "1")]
    for row, part in zip(rows, placed, strict=True):
        matrix = np.array([[float(row[f"m{i}{j}"]) for j in range(4)] for i in range(4)])
        assert (matrix == part.matrix).all()
        w, x, y, z = (float(row[name]) for name in ("qw", "qx", "qy", "qz"))
        assert Rotation.from_quat([x, y, z, w]).as_matrix() == pytest.approx(matrix[:3, :3])
        assert row["file"] == part.source


def test_formats_are_named_and_others_refused():
    assert exports.formats(" 3MF, csv") == ["3mf", "csv"]
    assert exports.formats("") == []
    with pytest.raises(InputError, match="'step' is not written; export some of 3mf, stl, csv"):
        exports.formats("stl,step")
