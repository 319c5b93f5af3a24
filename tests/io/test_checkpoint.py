"""State on disk: read back as written, refused where it is another's, never half-written."""

import pytest
import torch

from rasp_core.io import checkpoint
from rasp_core.util.errors import InputError

CPU = torch.device("cpu")
IDENTITY = {"settings": {"seed": 1}, "bodies": ["a", "b"]}


def test_state_is_read_back_as_written(tmp_path):
    path = tmp_path / "state.pt"
    assert checkpoint.load(path, IDENTITY, CPU) is None
    checkpoint.save(path, IDENTITY, {"turn": torch.arange(3.0), "iteration": 7})
    state = checkpoint.load(path, IDENTITY, CPU)
    assert torch.equal(state["turn"], torch.arange(3.0))
    assert state["iteration"] == 7


def test_damage_and_other_runs_are_refused(tmp_path):
    path = tmp_path / "state.pt"
    path.write_bytes(b"not a checkpoint")
    with pytest.raises(InputError, match="not a checkpoint"):
        checkpoint.load(path, IDENTITY, CPU)
    checkpoint.save(path, IDENTITY, {})
    with pytest.raises(InputError, match="other settings"):
        checkpoint.load(path, {**IDENTITY, "bodies": ["a"]}, CPU)


def test_a_checkpoint_that_cannot_be_written_leaves_the_last_one(tmp_path, monkeypatch):
    path = tmp_path / "state.pt"
    checkpoint.save(path, IDENTITY, {"iteration": 1})
    monkeypatch.setattr(torch, "save", lambda *a: (_ for _ in ()).throw(OSError("disk full")))
    with pytest.raises(OSError, match="disk full"):
        checkpoint.save(path, IDENTITY, {"iteration": 2})
    monkeypatch.undo()
    assert [file.name for file in tmp_path.iterdir()] == ["state.pt"]
    assert checkpoint.load(path, IDENTITY, CPU)["iteration"] == 1
