"""Caches where there is a home, where there is none, and beside a read-only install."""

from pathlib import Path

import pytest

from rasp_core.util import caches


@pytest.fixture(autouse=True)
def no_names(monkeypatch):
    for name in ("RASP_CACHE", "XDG_CACHE_HOME", "NUMBA_CACHE_DIR"):
        monkeypatch.delenv(name, raising=False)


def homeless(monkeypatch):
    def no_home():
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.setattr(caches.Path, "home", no_home)


def test_the_folder_that_is_named_comes_first(monkeypatch, tmp_path):
    monkeypatch.setenv("HOME", str(tmp_path))
    assert caches.cache_folder() == tmp_path / ".cache" / "rasp-kit"
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "x"))
    assert caches.cache_folder() == tmp_path / "x" / "rasp-kit"
    monkeypatch.setenv("RASP_CACHE", str(tmp_path / "named"))
    assert caches.cache_folder() == tmp_path / "named"


def test_a_user_without_a_home_has_temporary_files(monkeypatch):
    homeless(monkeypatch)
    assert caches.cache_folder() == caches.temporary_folder()
    assert caches.temporary_folder().parent.is_dir()


def test_a_home_that_cannot_be_written_to_is_none(monkeypatch, tmp_path):
    (tmp_path / "file").touch()
    monkeypatch.setenv("HOME", str(tmp_path / "file"))
    assert caches.cache_folder() == caches.temporary_folder()


def test_numba_is_left_alone_where_it_can_write(monkeypatch, tmp_path):
    caches.let_numba_cache(tmp_path)
    assert "NUMBA_CACHE_DIR" not in caches.os.environ
    (tmp_path / "file").touch()
    monkeypatch.setenv("HOME", str(tmp_path))
    caches.let_numba_cache(tmp_path / "file")
    assert "NUMBA_CACHE_DIR" not in caches.os.environ, "the user's cache will do"


@pytest.mark.parametrize("home", [True, False])
def test_a_read_only_install_gets_a_folder(monkeypatch, tmp_path, home):
    (tmp_path / "file").touch()
    if home:
        monkeypatch.setenv("HOME", str(tmp_path / "file"))
    else:
        homeless(monkeypatch)
    monkeypatch.setattr(caches, "temporary_folder", lambda: Path("/somewhere"))
    monkeypatch.setenv("NUMBA_CACHE_DIR", "")
    monkeypatch.delenv("NUMBA_CACHE_DIR")
    caches.let_numba_cache(tmp_path / "file")
    assert caches.os.environ["NUMBA_CACHE_DIR"] == "/somewhere/numba"
