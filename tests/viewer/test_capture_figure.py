"""The figure of a capture states the fitted material with digits that can be read."""

from __future__ import annotations

import pytest
from gonio.viewer import capture_figure


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("lambert(albedo=0.299996,0.19998,0.0999944)", "lambert(albedo=0.3,0.2,0.1)"),
        (
            "conductor(eta=1.49984,k=0,alpha=0.149985,fresnel=schlick)",
            "conductor(eta=1.5, k=0, alpha=0.15, fresnel=schlick)",
        ),
    ],
)
def test_numbers_have_three_digits_and_parameters_a_space(text: str, shown: str) -> None:
    assert capture_figure._rounded(text) == shown
