"""Heaps on threads: a plate that is out of the way, and what is seen, by rays."""

import csv
from dataclasses import replace

import numpy as np
import pytest
import torch
import trimesh
from heaps import SIDES, SIZE, heap
from manifold3d import Manifold
from oracles import cast_mask

from rasp_core.art import hanging
from rasp_core.art.hanging import PLATE_MM, RIM_MM, check_thread, hang
from rasp_core.geometry.cameras import Camera
from rasp_core.geometry.meshes import make_body
from rasp_core.util.errors import InputError


@pytest.fixture(scope="module")
def pair():
    return heap([(0.2, 0.0, 0.1), (-0.2, 0.1, -0.2)])


def test_the_plate_fills_the_printer_and_has_a_hole_for_each_thread(pair):
    found = hang(pair, printer_mm=(150, 150, 100))
    mesh = found.plate.to_mesh64()
    plate = trimesh.Trimesh(np.array(mesh.vert_properties)[:, :3], np.array(mesh.tri_verts))
    assert plate.is_watertight
    assert np.ptp(plate.bounds, axis=0) == pytest.approx(found.plate_mm)
    assert found.plate_mm[2] == PLATE_MM
    assert found.plate_mm[:2].max() == pytest.approx(150)
    assert found.plate_mm[0] - 2 * RIM_MM == pytest.approx(found.scale * 0.6)
    assert plate.euler_number == 2 - 2 * found.holes, "as many holes through it"
    assert found.holes == len(found.threads) == 4


def test_the_plate_is_above_all_that_hangs_and_before_no_picture(pair):
    found = hang(pair)
    top = found.threads[0].high[2]
    assert top > 0.2
    rows = [
        camera.pixels(np.array([[x, y, top] for x in (-0.3, 0.3) for y in (-0.3, 0.3)]), SIZE)[0] for camera in SIDES
    ]
    assert all(row.max() < np.argmax(picture.any(1)) for row, picture in zip(rows, pair.pictures, strict=True))
    assert found.plate.bounding_box()[2] == pytest.approx(found.scale * top + found.shift[2])


def cast_finely(solids, camera, fine):
    """Rays at finer pixels through all of some solids."""
    mesh = sum(solids, Manifold()).to_mesh64()
    whole = make_body("all", np.array(mesh.vert_properties)[:, :3], np.array(mesh.tri_verts))
    still = torch.eye(3, dtype=torch.float64)[None], torch.tensor(whole.centre[None])
    return cast_mask([whole], *still, camera, fine * SIZE)


@pytest.mark.parametrize("thread_mm", [0.3, 1.9])
def test_threads_are_seen_by_their_area(pair, thread_mm):
    found, fine = hang(pair, thread_mm=thread_mm), 16
    radius = thread_mm / 2 / found.scale
    parts = [Manifold.cube([0.2] * 3, True).translate(one) for one in pair.arrangement.translation.tolist()]
    rods = [thread.solid(radius) for thread in found.threads]
    for camera, image, picture in zip(SIDES, found.images, pair.pictures, strict=True):
        bare, whole = (cast_finely(solids, camera, fine) for solids in (parts, [*parts, *rods]))
        first = np.argmax(picture.any(1))
        seen = (whole & ~bare).reshape(SIZE, fine, SIZE, fine).mean((1, 3))
        extra, expected = image[first:][~picture[first:]].sum(), seen[first:][~picture[first:]].sum()
        assert extra == pytest.approx(expected, rel=0.1, abs=1)
        assert (image[:first] == 0).all()
        assert image[picture].min() == 1
    assert (found.likeness.min() < 0.99) == (thread_mm > 1)
    assert found.of_ceiling == pytest.approx(found.likeness, abs=0.02)


def test_the_table_says_where_each_thread_begins_and_ends(pair, tmp_path):
    found = hang(pair)
    found.write_table(tmp_path / "threads.csv")
    with (tmp_path / "threads.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["ends at"] for row in rows] == ["plate"] * 4
    for row, thread in zip(rows, found.threads, strict=True):
        assert float(row["z"]) == pytest.approx(0.1, abs=1e-6), "on the cube's upper face, in its own coordinates"
        assert float(row["length mm"]) == pytest.approx(found.scale * thread.length, abs=0.01)
        assert float(row["hole x mm"]) == pytest.approx((found.scale * thread.high + found.shift)[0], abs=0.01)
        assert 0 < float(row["load share"]) < 1
        assert row["object"] == pair.bodies[thread.body].name
    assert sum(float(row["load share"]) for row in rows) == pytest.approx(2, abs=1e-3), "one for each of two objects"


def test_one_thread_or_hardly_any_is_a_warning(pair):
    found = hang(pair)
    assert found.warnings == []
    alone = hanging.Hung(**{**vars(found), "threads": found.threads[:1]})
    assert alone.single == ["cube#2"] if found.threads[0].body else ["cube"]
    near = hanging.Hung(**{**vars(found), "threads": [replace(found.threads[0], high=found.threads[0].low)] * 2})
    assert near.warnings == ["2 threads are shorter than 1 mm; glue what they join"]
    assert alone.warnings == [f"one thread does not keep {alone.single[0]} from turning about it"]


def test_a_view_from_above_has_no_place_for_a_plate():
    with pytest.raises(InputError, match="no plate stays above all pictures; give level views"):
        hang(heap([(0, 0, 0)], cameras=[Camera(0, 0, 1.0), Camera(0, 90, 1.0)]))


def test_a_plate_is_no_larger_than_the_printer(pair):
    with pytest.raises(InputError, match=r"plate is 160 x 160 x 4 mm and the printer's volume 100 x 100 x 100; make"):
        hang(heap([(-0.2, 0.2, 0.0), (0.1, -0.1, 0.0)]), printer_mm=(100, 100, 100), scale=300.0)
    with pytest.raises(InputError, match="the plate is"):
        hang(pair, printer_mm=(100, 100, 3), thread_mm=0.02)


def test_objects_that_no_thread_holds_are_named():
    spike = trimesh.creation.cone(radius=0.02, height=0.3)
    with pytest.raises(InputError, match=r"no threads of 0.2 mm that cross nothing hold cube.* in balance; ask for"):
        hang(heap([(0, 0, 0), (0.2, 0, 0)], mesh=spike))


@pytest.mark.parametrize(
    ("printer", "thread", "said"),
    [
        ((200, 200), 0.3, "three positive lengths"),
        ((200, 200, 200), 0.0, "thicker than 0 and thinner than a hundredth of the printer's 200 mm, got 0 mm"),
        ((200, 200, 200), 3.0, "got 3 mm"),
        ((200, 20, 200), 0.1, "a plate needs 20 mm at least, got 20 mm"),
    ],
)
def test_lengths_go_together(printer, thread, said):
    with pytest.raises(InputError, match=said):
        check_thread(printer, thread)
