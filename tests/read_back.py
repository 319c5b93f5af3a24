"""Every run that a test saves is read back, and has to be what result.json says of it."""

import json

import numpy as np
import pytest

from rasp_core.api import run_folder
from rasp_core.exact.certificate import certify
from rasp_core.visualize.gltf import read_scene


def check(folder) -> None:
    """The folder's scene.glb against its result.json: objects, volumes to 1e-5, whether it is certified."""
    record = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    bodies, container = read_scene(folder)
    volumes = {body.name: body.volume for body in bodies}
    said = {entry["name"]: entry["volume"] for entry in record["objects"]}
    assert volumes == pytest.approx(said, rel=1e-5)
    assert container.volume == pytest.approx(record["container"]["volume"], rel=1e-5)
    found = certify(bodies, np.tile(np.eye(4), (len(bodies), 1, 1)), container)
    assert found.holds == record["certificate"]["holds"]


@pytest.fixture(autouse=True)
def runs_are_read_back(monkeypatch):
    """Whatever `save_run` writes while a test runs is checked at once."""
    save = run_folder.save_run

    def saved(folder, *arguments, **named):
        path = save(folder, *arguments, **named)
        if named.get("painted") is None:  # a painted heap is written as its texture's triangles
            check(path)
        return path

    monkeypatch.setattr(run_folder, "save_run", saved)
