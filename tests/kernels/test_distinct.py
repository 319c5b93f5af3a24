"""Which poses are kept, against a slow loop."""

import numpy as np
from scipy.spatial.transform import Rotation

from rasp_core.kernels.distinct import distinct


def test_kept_are_those_of_a_slow_loop():
    random = np.random.default_rng(4)
    rotation = Rotation.from_rotvec(random.normal(0, 0.15, (200, 3))).as_matrix()
    translation = random.normal(0, 1, (200, 3))
    kept = []
    for k in range(200):
        angles = [Rotation.from_matrix(rotation[k] @ rotation[n].T).magnitude() for n in kept]
        gaps = [np.linalg.norm(translation[k] - translation[n]) for n in kept]
        if not any(angle <= 0.2 and gap <= 1 for angle, gap in zip(angles, gaps, strict=True)):
            kept.append(k)
    found = distinct(rotation, translation, np.cos(0.2), 1.0, 200)
    assert 20 < len(kept) < 180
    assert found.tolist() == kept
    assert distinct(rotation, translation, np.cos(0.2), 1.0, 5).tolist() == kept[:5]
    assert len(distinct(rotation[:0], translation[:0], 0.5, 1.0, 5)) == 0
