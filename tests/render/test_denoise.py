"""The denoiser brings a noisy picture nearer to the clean one, and says so when it is missing."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from gonio.errors import InputError, MachineError
from gonio.pictures import denoise, metrics


@pytest.fixture
def pictures() -> tuple[np.ndarray, np.ndarray]:
    y, x = np.mgrid[:64, :96]
    clean = np.stack([1 + np.sin(x / 20), 1 + np.cos(y / 15), np.where(x > 50, 3.0, 0.5)], -1)
    clean = clean.astype(np.float32)
    noise = np.random.default_rng(2).gamma(2, 1 / 2, clean.shape)
    return (clean * noise).astype(np.float32), clean


def test_denoising_brings_the_picture_nearer_to_the_truth(pictures: tuple[np.ndarray, np.ndarray]) -> None:
    pytest.importorskip("pyoidn")
    noisy, clean = pictures
    before = noisy.copy()
    result = denoise.denoise(noisy)
    assert result.shape == clean.shape and result.dtype == np.float32
    assert metrics.relmse(result, clean) < 0.1 * metrics.relmse(noisy, clean)
    assert abs(metrics.mean_ratio(result, clean) - 1) < 0.05  # bright values are kept, not clamped at 1
    assert np.array_equal(noisy, before)


def test_a_value_that_is_not_finite_does_not_spread(pictures: tuple[np.ndarray, np.ndarray]) -> None:
    pytest.importorskip("pyoidn")
    noisy = pictures[0].copy()
    noisy[10, 10] = np.nan
    noisy[20, 20, 1] = np.inf
    assert np.isfinite(denoise.denoise(noisy, albedo=np.full_like(noisy, 0.5))).all()


def test_a_missing_denoiser_is_a_fault_of_the_machine_with_a_hint(
    pictures: tuple[np.ndarray, np.ndarray], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(denoise, "available", lambda: "")
    with pytest.raises(MachineError, match="not installed") as caught:
        denoise.denoise(pictures[0])
    assert "pip install" in caught.value.hint


def test_an_unusable_denoiser_is_a_fault_of_the_machine(
    pictures: tuple[np.ndarray, np.ndarray], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(denoise, "available", lambda: "0.1")
    monkeypatch.setitem(sys.modules, "pyoidn.denoise", None)
    with pytest.raises(MachineError, match=r"pyoidn 0\.1 cannot be used"):
        denoise.denoise(pictures[0])


def test_guides_of_another_shape_are_refused(pictures: tuple[np.ndarray, np.ndarray]) -> None:
    with pytest.raises(InputError, match="'albedo' has shape"):
        denoise.denoise(pictures[0], albedo=np.zeros((3, 3, 3)))
    with pytest.raises(InputError, match="normal map alone"):
        denoise.denoise(pictures[0], normal=np.zeros_like(pictures[0]))
