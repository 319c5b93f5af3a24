"""The solver of a step against a dense solution, turns against another library's."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rasp_core.kernels import levenberg_marquardt
from rasp_core.kernels.levenberg_marquardt import _solve, _turn


def test_conjugate_gradients_solve_the_system():
    random = np.random.default_rng(0)
    pairs = np.array([(1, 0), (2, 0), (3, 2), (4, 1)])
    full = np.zeros((5, 6, 5, 6))
    for one, two in pairs:
        rows = np.zeros((40, 5, 6))
        rows[:, one], rows[:, two] = random.standard_normal((2, 40, 6))
        full += np.einsum("kai,kbj->aibj", rows, rows)
    diagonal = np.array([full[b, :, b] + np.eye(6) for b in range(5)])
    coupling = np.array([full[one, :, two] for one, two in pairs])
    pull = random.standard_normal((5, 6))
    dense = np.linalg.solve(full.reshape(30, 30) + np.eye(30), -pull.ravel())
    found = _solve(diagonal, coupling, pairs, len(pairs), pull)
    left = (full.reshape(30, 30) + np.eye(30)) @ found.ravel() + pull.ravel()
    assert np.linalg.norm(left) < levenberg_marquardt.SOLVED**0.5 * np.linalg.norm(pull)
    assert found.ravel() == pytest.approx(dense, abs=0.1 * np.abs(dense).max())


@pytest.mark.parametrize("vector", [(0.3, -0.2, 0.9), (0, 0, 0), (1e-9, 0, 0)])
def test_turns_are_rotation_vectors(vector):
    rotation = Rotation.from_euler("xyz", (0.1, 0.7, -1.2)).as_matrix()
    expected = Rotation.from_rotvec(vector).as_matrix() @ rotation
    _turn(rotation, np.array(vector, float))
    assert rotation == pytest.approx(expected, abs=1e-12)
