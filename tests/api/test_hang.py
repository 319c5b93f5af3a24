"""A heap on threads, at the door: shown, described, saved with its run."""

import json
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from rooms import ROOM

import rasp_core as rasp
from data_fetch import kitchen_like
from rasp_core.api.hang import HungResult
from rasp_core.art.room_file import room_of
from rasp_core.physics.swinging import Swinging


@pytest.fixture(scope="module")
def heap():
    return rasp.sculpt(kitchen_like(4), text=["L", "T"], width=0.5, resolution=64, count=12, time_limit=5.0)


def test_it_is_shown_and_saved_with_its_run(heap, tmp_path):
    hung = heap.hang(printer_mm=(120, 120, 150))
    assert hung.holds
    assert hung.warnings == heap.warnings
    assert repr(hung).startswith(f"<Hung: {len(heap.bodies)} objects on ")
    assert hung.table()["swinging"] == "hangs still after 5 s"
    assert np.asarray(hung.show((200, 200))).shape == (200, 200, 3)
    assert "data:image" in hung._repr_html_()
    folder = hung.save(tmp_path / "run")
    record = json.loads((folder / "result.json").read_text())
    assert record["command"] == "art"
    assert record["hang"]["swinging"]["stays"]
    lines = (folder / "threads.csv").read_text().splitlines()
    assert len(lines) == 1 + record["hang"]["threads"]


def test_the_objects_and_the_plate_lie_in_the_file_where_they_hang(heap, tmp_path):
    hung = heap.hang(printer_mm=(120, 120, 150))
    scene = trimesh.load(hung.save(tmp_path / "run") / "hung.3mf")
    meshes = scene.dump()
    assert len(meshes) == len(heap.bodies) + 1
    scale, shift = hung.hung.scale, hung.hung.shift
    placed = np.concatenate([body.placed(matrix) for body, matrix in zip(heap.bodies, heap.matrices, strict=True)])
    low, high = scale * placed.min(0) + shift, scale * placed.max(0) + shift
    objects = [mesh for mesh in meshes if not np.allclose(np.ptp(mesh.bounds, axis=0), hung.hung.plate_mm, atol=1e-3)]
    assert np.min([mesh.bounds[0] for mesh in objects], axis=0) == pytest.approx(low, abs=1e-3)
    assert np.max([mesh.bounds[1] for mesh in objects], axis=0) == pytest.approx(high, abs=1e-3)
    assert low[2] == pytest.approx(0, abs=1e-6)


def test_threads_too_short_to_be_seen_are_not_drawn(heap):
    hung = heap.hang()
    short = replace(hung.hung.threads[0], high=hung.hung.threads[0].low)
    found = replace(hung, hung=replace(hung.hung, threads=[short, *hung.hung.threads[1:]]))
    assert len(found.shown[0]) == len(hung.shown[0]) - 1


def test_what_does_not_hang_still_is_said(heap):
    hung = heap.hang()
    turned = HungResult(heap, hung.hung, Swinging(0.2, 90.0, 5.0))
    assert not turned.holds
    assert turned.warnings[-1] == "does not hang still: an object turned by 90 degrees in 5 s"


def test_in_a_room_it_has_the_size_that_its_shadows_need():
    quick = {"resolution": 64, "count": 12, "time_limit": 5.0}
    heap = rasp.sculpt(kitchen_like(4), text=["L", "T"], room=room_of(ROOM), width=0.5, **quick)
    hung = heap.hang(printer_mm=(400, 400, 300))
    assert hung.hung.plate_mm[:2] - 10 == pytest.approx(1000 * heap.in_room.size[:2], abs=0.1)
