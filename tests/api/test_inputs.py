"""Objects and containers as the door takes them."""

import pytest
import trimesh

from rasp_core.api.inputs import as_bodies, as_container, box, load
from rasp_core.geometry.containers import FreeBox
from rasp_core.util.errors import InputError


def test_a_folder_a_file_and_a_list_are_loaded_alike(cans):
    files = sorted(cans.iterdir())
    names = [body.name for body in load(cans)]
    assert names == [path.stem for path in files]
    assert [body.name for body in load(str(cans))] == names
    assert [body.name for body in load(files)] == names
    assert load(files[0])[0].volume == pytest.approx(trimesh.load_mesh(files[0]).volume)


def test_what_is_not_there_is_named(tmp_path):
    with pytest.raises(InputError, match="gone"):
        load(tmp_path / "gone.stl")


def test_objects_that_are_loaded_stay_as_they_are(cans):
    bodies = load(cans)
    assert as_bodies(bodies) == bodies
    assert [body.name for body in as_bodies([cans])] == [body.name for body in bodies]


def test_containers_by_edges_by_words_and_by_mesh(cans):
    room = box(0.3, 0.2, 0.1)
    assert room.volume == pytest.approx(0.006)
    assert as_container(room) is room
    assert as_container("box:0.3,0.2,0.1").volume == pytest.approx(0.006)
    assert isinstance(as_container("auto:cube"), FreeBox)
    can = sorted(cans.iterdir())[0]
    assert as_container(can).volume == pytest.approx(trimesh.load_mesh(can).volume)
    with pytest.raises(InputError, match="positive edges"):
        box(0.3, 0, 0.1)
