"""What all results have in common."""

import json

import numpy as np
import pytest
from matplotlib.figure import Figure

import rasp_core as rasp
from data_fetch import kitchen_like


@pytest.fixture(scope="module")
def found():
    return rasp.optimize(kitchen_like(3), rasp.box(0.3, 0.3, 0.3), iterations=5, resolution=64)


def test_it_leads_to_what_is_asked_for_most(found):
    assert found.bodies == found.arrangement.problem.bodies
    assert found.container.volume == pytest.approx(0.027)
    assert found.matrices.shape == (3, 4, 4)
    assert found.poses.rotation.shape == (3, 3, 3)
    assert found.density == pytest.approx(sum(body.volume for body in found.bodies) / 0.027)


def test_it_can_be_seen(found):
    picture = found.show(size=(200, 160), azimuth_deg=10)
    assert picture.size == (200, 160)
    assert np.asarray(picture).std() > 1, "something is drawn"
    assert isinstance(found.plot(), Figure)
    html = found._repr_html_()
    assert "density (Eq. 6)" in html
    assert "data:image" in html


def test_it_is_kept(found, tmp_path):
    folder = found.save(tmp_path / "run", {"note": 1})
    record = json.loads((folder / "result.json").read_text())
    assert record["note"] == 1
    assert record["density"] == found.density
    assert len((folder / "history.csv").read_text().splitlines()) == 6


def test_faults_are_said():
    crowd = rasp.optimize(kitchen_like(8), rasp.box(0.1, 0.1, 0.1), iterations=1, resolution=32)
    assert "not certified: " in repr(crowd)
