"""Assembly at the door: from the whole's mesh, from its silhouettes, and from neither."""

import json

import numpy as np
import pytest
import trimesh

import rasp_core as rasp
from data_fetch import fracture, scatter, vessels
from rasp_core.assembly.metrics import measure
from rasp_core.util.errors import InputError


@pytest.fixture(scope="module")
def broken():
    vessel = vessels()[0]
    shards, truth = scatter(fracture(vessel, 2, 0), 0)
    return vessel, shards, truth


def test_parts_come_back_and_say_how_they_fit(broken, tmp_path):
    vessel, shards, truth = broken
    whole = tmp_path / "whole.ply"
    trimesh.Trimesh(vessel.vertices, vessel.faces, process=False).export(whole)
    found = rasp.assemble(shards, whole)
    assert measure(shards, found.matrices, truth).parts == 1
    assert found.warnings == []
    assert repr(found).startswith("<Assembly of 2 parts, fit of their surfaces: ")
    record = json.loads((found.save(tmp_path / "run") / "result.json").read_text())
    assert record["command"] == "assemble"
    assert set(record["scores"]) == {shard.name for shard in shards}
    assert found.table()["parts"] == "2"


def test_the_pieces_alone_are_enough(broken):
    _, shards, truth = broken
    found = rasp.assemble(shards)
    assert measure(shards, found.matrices, truth).parts == 1
    assert repr(found).startswith("<Assembly of 2 parts, creases matched: ")


def test_mesh_and_silhouettes_together_are_refused(broken):
    vessel, shards, _ = broken
    with pytest.raises(InputError, match="give one of them"):
        rasp.assemble(shards, vessel, silhouettes=["a.png"])
    with pytest.raises(InputError, match="for 2 pictures"):
        rasp.assemble(shards, silhouettes=np.ones((2, 8, 8)), width=1.0)
    with pytest.raises(InputError, match="width in metres; give --width"):
        rasp.assemble(shards, silhouettes=np.ones((3, 8, 8)))
    for ignored in ({"width": 1.0}, {"azimuths_deg": [0]}, {"elevations_deg": [0]}):
        with pytest.raises(InputError, match="is of silhouettes, and there are none"):
            rasp.assemble(shards, vessel, **ignored)
