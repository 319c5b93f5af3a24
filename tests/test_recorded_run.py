"""The recorded run that the site shows is of what its script says."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from read_recording import read

from data_fetch import kitchen_like
from rasp_core.geometry.containers import box
from rasp_core.poses import Poses

ROOT = Path(__file__).parent.parent


@pytest.fixture
def script(monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "tools")
    import record_run

    return record_run


def test_it_is_of_the_scripts_objects_settings_and_start(script):
    path = ROOT / "docs" / "recorded_run.json"
    held = json.loads(path.read_text())
    assert path.stat().st_size < 100_000
    bodies = kitchen_like(script.COUNT, seed=script.SETTINGS.seed)
    assert [name for name, _, _ in held["objects"]] == [body.name for body in bodies]
    assert held["varied"] == {"lambda": [*script.LAMBDAS], "epsilon (m)": [*script.EPSILONS]}
    assert [run["values"] for run in held["runs"]] == [
        [one, other] for one in script.LAMBDAS for other in script.EPSILONS
    ]
    start = Poses.random(bodies, box([script.EDGE] * 3), script.SETTINGS.seed)
    _, runs, curves = read(held)
    for run, poses, (losses, overlap) in zip(held["runs"], runs, curves, strict=True):
        assert run["iterations"][-1] == run["total"] == script.SETTINGS.iterations
        assert len(poses) == script.FRAMES
        assert np.abs(poses[0, :, :3] - start.translation.numpy()).max() < 1e-4
        assert np.isfinite(losses).all()
        assert len(overlap) == script.FRAMES
    strongest = curves[-1][0]
    assert strongest[-1, 1] > strongest[0, 1], "the walls win over the shadows, as the page says"
    weakest = [losses[-1, 1] for losses, _ in curves[:3]]
    assert max(weakest) < 1.05 * min(weakest), "and at the paper's lambda epsilon makes no difference"


def test_the_script_writes_what_it_records(script, monkeypatch, tmp_path):
    monkeypatch.setattr(script, "COUNT", 2)
    monkeypatch.setattr(script, "LAMBDAS", (0.5,))
    monkeypatch.setattr(script, "SETTINGS", replace(script.SETTINGS, iterations=3, resolution=16))
    script.record(tmp_path / "run.json")
    held = json.loads((tmp_path / "run.json").read_text())
    assert [run["values"] for run in held["runs"]] == [[0.5, other] for other in script.EPSILONS]
