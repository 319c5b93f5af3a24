"""Solids from voxels: parts of which the size is known, and instances as they are listed."""

import numpy as np
import pytest
import trimesh
from trimesh.exchange import binvox

from data_fetch.nesting import INSTANCES, nesting_instance, rebuild
from rasp_core.util.errors import InputError


def voxels(path, full, pitch):
    """Write a .binvox file of voxels `pitch` wide, as its format has it: runs of bytes, y fastest, then z, then x."""
    size = len(full)
    flat = np.transpose(full, (0, 2, 1)).ravel().astype(np.uint8)
    ends = np.flatnonzero(np.append(np.diff(flat) != 0, True)) + 1
    runs = bytearray()
    for start, end in zip(np.append(0, ends[:-1]), ends, strict=True):
        for length in [255] * ((end - start) // 255) + [(end - start) % 255]:
            runs += bytes([flat[start], length]) if length else b""
    head = f"#binvox 1\ndim {size} {size} {size}\ntranslate 0 0 0\nscale {size * pitch}\ndata\n"
    path.write_bytes(head.encode() + bytes(runs))
    assert np.array_equal(binvox.load_binvox(path.open("rb")).matrix, full)
    return path


def test_a_block_has_its_size_without_half_a_voxel_all_round(tmp_path):
    full = np.zeros((20, 20, 20), bool)
    full[2:13, 3:9, 4:18] = True  # 10 x 5 x 13 steps between the outermost centres
    body = rebuild(voxels(tmp_path / "block_nh.binvox", full, 0.2))
    assert body.name == "block"
    assert np.ptp(body.vertices, axis=0) == pytest.approx([2.0, 1.0, 2.6], abs=1e-4)
    assert body.vertices.min(0) == pytest.approx([0, 0, 0], abs=1e-9)
    assert body.volume == pytest.approx(5.2, rel=1e-3)
    assert len(body.faces) == 12


def test_what_is_not_convex_keeps_its_hole(tmp_path):
    full = np.zeros((20, 20, 20), bool)
    full[2:17, 2:17, 5:10] = True
    full[6:13, 6:13, :] = False
    body = rebuild(voxels(tmp_path / "ring.binvox", full, 1.0))
    exact = trimesh.creation.box((14, 14, 4)).volume - 8 * 8 * 4
    assert body.volume == pytest.approx(exact, rel=0.02)
    assert trimesh.Trimesh(body.vertices, body.faces).euler_number == 0


@pytest.mark.parametrize("data", [b"", b"#binvox 1\ndim 8 8 8\ndata\n", b"solid of something\n"])
def test_what_holds_no_voxels_is_refused(tmp_path, data):
    path = tmp_path / "bad.binvox"
    path.write_bytes(data)
    with pytest.raises(InputError, match=r"bad\.binvox: cannot be read as voxels"):
        rebuild(path)


def test_an_unknown_instance_is_refused():
    with pytest.raises(InputError, match="use one of chess, "):
        nesting_instance("checkers")


@pytest.mark.real_data
@pytest.mark.parametrize("name", INSTANCES)
def test_instances_have_the_parts_that_are_listed(data, monkeypatch, name):
    monkeypatch.setenv("RASP_DATA_MIRROR", str(data))
    rows = [line.split(",") for line in (data / "nesting" / "instances.csv").read_text().splitlines()[1:]]
    _, x, y, parts, *_ = next(row for row in rows if row[0] == name)
    instance = nesting_instance(name)
    assert instance.base == pytest.approx([float(x), float(y)], abs=1e-3)
    assert sum(instance.parts.values()) == int(parts)


@pytest.mark.real_data
def test_parts_are_those_that_were_measured(data, monkeypatch):
    monkeypatch.setenv("RASP_DATA_MIRROR", str(data))
    for path in (path for path in nesting_instance("liu").parts):
        other = trimesh.load(data / "nesting" / "parts" / f"{path.name.removesuffix('_nh.binvox')}.obj", process=False)
        assert rebuild(path).volume == pytest.approx(other.volume, rel=1e-3)
