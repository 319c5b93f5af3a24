import numpy as np
import pytest

from data_fetch.scans import reconstruct
from rasp_core.util.errors import InputError


def ball(count=4000):
    """Points and outward normals, of any length, of a unit ball's surface."""
    k = np.arange(count) + 0.5
    polar, turn = np.arccos(1 - 2 * k / count), np.pi * (1 + 5**0.5) * k
    points = np.column_stack([np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)])
    return np.hstack([points, points * np.linspace(0.5, 3, count)[:, None]])


def test_ball_has_its_volume_and_name(tmp_path):
    np.save(tmp_path / "ball.npy", ball())
    body = reconstruct(tmp_path / "ball.npy", depth=5)
    assert body.name == "ball"
    assert body.volume == pytest.approx(4 / 3 * np.pi, rel=0.01)


@pytest.mark.parametrize(
    ("array", "words"),
    [
        (np.zeros((5, 3)), "points and normals, got float64"),
        (np.zeros((5, 6), int), "points and normals, got int"),
        (np.zeros((5, 6)), "without a finite place and normal"),
        (np.full((5, 6), np.nan), "without a finite place and normal"),
    ],
)
def test_arrays_that_are_no_scan(tmp_path, array, words):
    np.save(tmp_path / "scan.npy", array)
    with pytest.raises(InputError, match=words):
        reconstruct(tmp_path / "scan.npy")


def test_files_that_are_no_array(tmp_path):
    (tmp_path / "scan.npy").write_text("points")
    with pytest.raises(InputError, match="cannot be read as a scan"):
        reconstruct(tmp_path / "scan.npy")
    with pytest.raises(InputError, match="cannot be read as a scan"):
        reconstruct(tmp_path / "none.npy")
