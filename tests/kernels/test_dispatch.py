"""The choice of engine, and work on several threads."""

import pytest
import torch

from rasp_core import losses, poses, query_points, silhouettes
from rasp_core.kernels import dispatch, surface_contact
from rasp_core.objective import find_neighbours
from rasp_core.problem import Settings
from rasp_core.util.errors import InputError

CPU, GPU = torch.device("cpu"), torch.device("cuda")


def test_the_cpu_is_compiled_unless_told_otherwise_and_other_devices_never():
    assert dispatch.compiled(CPU)
    assert not dispatch.compiled(GPU)
    with dispatch.use("torch"):
        assert not dispatch.compiled(CPU)
        with dispatch.use("auto"):
            assert dispatch.compiled(CPU)
        assert not dispatch.compiled(CPU)
    assert dispatch.compiled(CPU)


def test_an_unknown_engine_is_refused():
    with pytest.raises(InputError, match="abacus"), dispatch.use("abacus"):
        pass


@pytest.fixture(params=[1, 2, 3])
def threads(request):
    before = torch.get_num_threads()
    torch.set_num_threads(request.param)
    yield request.param
    torch.set_num_threads(before)


def test_work_is_done_by_as_many_workers_as_torch_has_threads(threads):
    assert dispatch.in_parallel(lambda worker, workers, base: (worker, workers, base), 7) == [
        (worker, threads, 7) for worker in range(threads)
    ]


def test_torch_has_one_thread_beside_the_compiled_loops_only(threads):
    with dispatch.one_torch_thread(CPU):
        assert torch.get_num_threads() == 1
        assert dispatch.workers() == threads
    assert torch.get_num_threads() == dispatch.workers() == threads
    with dispatch.use("torch"), dispatch.one_torch_thread(CPU):
        assert torch.get_num_threads() == threads


def test_results_do_not_depend_on_the_number_of_threads(crowd):
    scene, turns, place = crowd
    rotation, lattice = poses.angles_to_rotation(turns), query_points.query_lattice(scene.container, 20_000)
    near = find_neighbours(scene, rotation, place, Settings())
    before, found = torch.get_num_threads(), []
    try:
        for threads in (1, 2, 3):
            torch.set_num_threads(threads)
            centre = place.clone().requires_grad_()
            value = losses.overlap(scene.stack, scene.half, rotation, centre, lattice)
            touch = surface_contact.contact(
                scene.stack, scene.samples, near, scene.container, rotation, centre, torch.zeros(12).double()
            )
            image = silhouettes.render(scene.outlines, rotation, centre, scene.views, 128)
            again = find_neighbours(scene, rotation, place, Settings())
            (value + touch + image.square().sum()).backward()
            found.append((value.detach(), touch.detach(), image.detach(), centre.grad, again.touching, again.by_wall))
    finally:
        torch.set_num_threads(before)
    for other in found[1:]:
        assert all(torch.equal(a, b) for a, b in zip(found[0], other, strict=True))
