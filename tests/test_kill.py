"""Two of the killed runs of `kill`; twenty by `python tests/kill.py`."""

import contextlib
import sys
from pathlib import Path

import numpy as np

from data_fetch import kitchen_like
from rasp_core.api import run_folder
from rasp_core.exact.certificate import certify
from rasp_core.geometry.containers import box
from rasp_core.optimizer import optimize
from rasp_core.problem import Problem, Settings

sys.path.insert(0, str(Path(__file__).parent))
import kill


def test_a_killed_run_leaves_nothing_that_disturbs_the_next():
    assert kill.run(2, seed=3) == []


def test_a_record_never_lies_beside_another_runs_files(tmp_path, monkeypatch):
    """Killed between two files, a folder has no record, and the next run clears what is left."""
    run = optimize(Problem(kitchen_like(2), box((0.3, 0.3, 0.3))), Settings(iterations=2, resolution=32))
    certificate = certify(run.problem.bodies, run.matrices, run.problem.container)
    run_folder.save_run(tmp_path, run, certificate, {})
    replace, moved = run_folder.os.replace, []

    def killed(source, target):
        if moved:
            raise SystemExit
        moved.append(target)
        replace(source, target)

    with monkeypatch.context() as patch:
        patch.setattr(run_folder.os, "replace", killed)
        patch.setattr(run_folder.shutil, "rmtree", lambda *_, **__: None)
        with contextlib.suppress(SystemExit):
            run_folder.save_run(tmp_path, run, certificate, {})
    assert not (tmp_path / "result.json").exists()
    assert list(tmp_path.glob(".part-*"))
    run_folder.save_run(tmp_path, run, certificate, {"density": np.pi})
    names = sorted(path.name for path in tmp_path.iterdir())
    assert names == ["history.csv", "result.json", "scene.glb", "silhouettes.png"]
