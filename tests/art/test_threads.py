"""Threads: straight up, in balance by the solids' own centres of mass, through nothing by rays."""

import numpy as np
import pytest
import trimesh
from oracles import winding_number

from data_fetch import kitchen_like
from rasp_core.art.threads import find_threads
from rasp_core.geometry.meshes import make_body, unique_names

RADIUS = 0.001


def at(*places):
    matrices = np.tile(np.eye(4), (len(places), 1, 1))
    matrices[:, :3, 3] = places
    return matrices


def cubes(*edges):
    meshes = [trimesh.creation.box([edge] * 3 if np.isscalar(edge) else edge) for edge in edges]
    return unique_names([make_body("block", mesh.vertices, mesh.faces) for mesh in meshes])


def meshes_of(bodies, matrices):
    found = []
    for body, matrix in zip(bodies, matrices, strict=True):
        mesh = trimesh.Trimesh(body.vertices, body.faces)
        mesh.apply_transform(matrix)
        found.append(mesh)
    return found


def check_balance(bodies, matrices, threads):
    """Forces and torques of each object, by threads and weights, are zero; each is held above what it carries."""
    for i, mesh in enumerate(meshes_of(bodies, matrices)):
        up = [thread for thread in threads if thread.body == i]
        down = [thread for thread in threads if thread.above == i]
        carried = mesh.volume + sum(thread.load for thread in down)
        assert sum(thread.load for thread in up) == pytest.approx(carried)
        middle = (mesh.volume * mesh.center_mass + sum((t.load * t.high for t in down), np.zeros(3))) / carried
        held = sum(thread.load * thread.low for thread in up) / carried
        assert held[:2] == pytest.approx(middle[:2], abs=1e-6)
        assert held[2] > middle[2]


def check_clear(bodies, matrices, threads):
    """No point along a thread, but for its ends, lies in an object."""
    for thread in threads:
        assert thread.low[:2] == pytest.approx(thread.high[:2])
        end = np.array([0, 0, 1e-5])
        along = np.linspace(thread.low + end, thread.high - end, 200)
        for body, matrix in zip(bodies, matrices, strict=True):
            assert (winding_number(along, body.placed(matrix), body.solid_faces) < 0.5).all()


def test_a_cube_hangs_by_two_threads_from_the_plate():
    bodies, matrices = cubes(0.2), at((0.3, 0.1, 0.0))
    threads, alone = find_threads(bodies, matrices, 0.5, RADIUS)
    assert alone == []
    assert [thread.above for thread in threads] == [None, None]
    assert [thread.high[2] for thread in threads] == [0.5, 0.5]
    assert [thread.low[2] for thread in threads] == pytest.approx([0.1, 0.1], abs=1e-6)
    check_balance(bodies, matrices, threads)
    assert np.linalg.norm(threads[0].low - threads[1].low) > 0.15, "wide apart"


def test_threads_go_where_they_are_not_seen_if_they_can():
    bodies, matrices = cubes(0.2), at((0.0, 0.0, 0.0))
    threads, _ = find_threads(bodies, matrices, 0.5, RADIUS, lambda points: np.abs(points[:, 0]) > 0.02)
    assert [thread.low[0] for thread in threads] == pytest.approx([0, 0], abs=0.02)
    assert np.linalg.norm(threads[0].low - threads[1].low) > 0.1, "wide apart in the other direction"


def test_what_is_below_another_hangs_from_it_and_both_are_in_balance():
    bodies, matrices = cubes(0.1, (0.4, 0.4, 0.1)), at((0.12, 0.1, 0.0), (0.0, 0.0, 0.3))
    threads, alone = find_threads(bodies, matrices, 0.5, RADIUS)
    assert alone == []
    assert [thread.above for thread in threads if thread.body == 0] == [1, 1]
    check_balance(bodies, matrices, threads)
    check_clear(bodies, matrices, threads)


def test_what_is_held_inside_another_goes_first():
    shell = trimesh.boolean.difference([trimesh.creation.box([0.4] * 3), trimesh.creation.box([0.36] * 3)])
    bodies = [make_body("shell", shell.vertices, shell.faces), *cubes(0.1)]
    matrices = at((0, 0, 0), (0.02, 0, 0.05))
    threads, alone = find_threads(bodies, matrices, 0.5, RADIUS)
    assert alone == []
    assert [thread.above for thread in threads if thread.body == 1] == [0, 0]
    check_balance(bodies, matrices, threads)


def test_where_another_object_touches_a_thread_has_no_length():
    bodies, matrices = cubes(0.2, (0.1, 0.2, 0.1)), at((0.0, 0.0, 0.0), (0.05, 0.0, 0.149999))
    threads, alone = find_threads(bodies, matrices, 0.5, RADIUS)
    assert alone == []
    lengths = {thread.above: thread.length for thread in threads if thread.body == 0}
    assert lengths == {None: pytest.approx(0.4), 1: 0.0}
    check_balance(bodies, matrices, threads)


def test_what_nothing_holds_above_its_middle_is_named():
    spike = trimesh.creation.cone(radius=0.2, height=0.3)  # all its upper side is steep
    spike.apply_scale((0.1, 0.1, 1.0))
    bodies = [make_body("spike", spike.vertices, spike.faces), *cubes(0.1)]
    threads, alone = find_threads(bodies, at((0, 0, 0), (0.5, 0, 0)), 0.5, RADIUS)
    assert alone == [0]
    assert {thread.body for thread in threads} == {1}


def test_threads_keep_clear_of_other_objects_and_of_each_other():
    random = np.random.default_rng(0)
    bodies = kitchen_like(12)
    matrices = at(*(np.array([0.12 * (k % 3), 0.12 * (k // 3 % 2), 0.16 * (k // 6)]) for k in range(12)))
    matrices[:, :2, 3] += random.uniform(-0.01, 0.01, (12, 2))
    threads, alone = find_threads(bodies, matrices, 0.6, RADIUS)
    assert alone == []
    check_balance(bodies, matrices, threads)
    check_clear(bodies, matrices, threads)
    for k, one in enumerate(threads):
        for other in threads[k + 1 :]:
            beside = np.linalg.norm(one.low[:2] - other.low[:2]) >= 2 * RADIUS
            assert beside or one.low[2] >= other.high[2] or other.low[2] >= one.high[2]
