"""The authors' losses are theirs."""

import csv
from pathlib import Path

import numpy as np
import pytest

from rasp_core.reproduce import authors_run

THEIRS = Path(__file__).parents[3] / "shared" / "paper" / "authors_losses.csv"


def test_losses_are_told_at_each_iteration():
    assert len(authors_run.AT) == len(authors_run.SILHOUETTE) == len(authors_run.OVERLAP)
    assert np.all(np.diff(authors_run.AT) > 0)
    assert authors_run.AT[-1] < authors_run.ITERATIONS


def test_eq_2_is_a_mean_over_pixels():
    found = authors_run.silhouette()
    assert np.all((found > 0) & (found < 1))
    assert found[0] * authors_run.PIXELS * authors_run.WEIGHT == pytest.approx(authors_run.SILHOUETTE[0])


@pytest.mark.skipif(not THEIRS.is_file(), reason="the authors' file is not beside the checkout")
def test_losses_are_what_the_authors_file_says():
    with THEIRS.open(newline="") as file:
        rows = [[float(text) for text in row[:2]] for row in list(csv.reader(file))[1:]]
    told = np.array([authors_run.SILHOUETTE, authors_run.OVERLAP]).T
    assert authors_run.AT[-1] == len(rows) - 1
    assert np.allclose(told, np.array(rows)[list(authors_run.AT)], rtol=5e-3, atol=0.06)
