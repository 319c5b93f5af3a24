"""Arrays kept between runs: made once, made again where the file is damaged, done without where none can be written."""

import numpy as np

from rasp_core.io.kept_arrays import kept


def test_arrays_are_made_once_and_again_where_the_file_is_damaged(tmp_path, monkeypatch):
    monkeypatch.setenv("RASP_CACHE", str(tmp_path))
    calls = []

    def make():
        calls.append(1)
        return {"x": np.arange(3.0), "y": np.array(2)}

    for _ in range(2):
        found = kept("room", "words", make)
        assert (found["x"].tolist(), int(found["y"])) == ([0, 1, 2], 2)
    assert len(calls) == 1
    (file,) = (tmp_path / "room").iterdir()
    file.write_bytes(b"damaged")
    kept("room", "words", make)
    kept("room", "words", make)
    kept("room", "other words", make)
    assert len(calls) == 3


def test_a_cache_that_cannot_be_written_is_done_without(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("RASP_CACHE", str(tmp_path / "file"))
    assert kept("room", "words", lambda: {"x": np.ones(1)})["x"] == 1
