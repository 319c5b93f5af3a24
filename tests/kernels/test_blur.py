"""The compiled blur against torch's convolution."""

import pytest
import torch

from rasp_core import silhouettes
from rasp_core.kernels import dispatch


@pytest.mark.parametrize("softness", [0.4, 1.0, 8.0, 40.0])
@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_blur(softness, dtype):
    images = torch.rand(2, 40, 48, generator=torch.Generator().manual_seed(0), dtype=dtype)
    with dispatch.use("torch"):
        expected = silhouettes.soften(images, softness)
    assert torch.allclose(silhouettes.soften(images, softness), expected, atol=1e-5)
