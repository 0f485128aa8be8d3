"""What `sample` of a user's material returns is checked, and plain numbers in it stand for every ray."""

from __future__ import annotations

from typing import Any

import gonio as go
import numpy as np
import pytest
from gonio.optics import warp

WO = np.array([[0.0, 0.6, 0.8]])
U = np.array([[0.3, 0.6, 0.1]])


class Matte(go.BSDF):
    albedo: go.Colour = go.spectrum(1.0, "fraction of light that is reflected")

    def eval(self, wo: Any, wi: Any) -> Any:
        return self.albedo * self.pdf(wo, wi)

    def pdf(self, wo: Any, wi: Any) -> Any:
        return go.ops.where((wo.z > 0.0) & (wi.z > 0.0), wi.z * go.ops.inv_pi, 0.0)

    def sample(self, wo: Any, u: Any) -> Any:
        wi = warp.square_to_cosine_hemisphere(u.x, u.y)
        return self.returned(wo, wi, self.pdf(wo, wi))

    def returned(self, wo: Any, wi: Any, pdf: Any) -> Any:
        return go.Sample(wi, self.eval(wo, wi) / pdf, pdf, False, 1)


def test_plain_values_stand_for_every_ray() -> None:
    sample = Matte().sample(np.repeat(WO, 3, axis=0), np.repeat(U, 3, axis=0))
    assert sample.delta.tolist() == [False] * 3 and sample.eta.tolist() == [1.0] * 3
    assert np.allclose(sample.weight, 1.0)
    assert "1.0" in go.emit(Matte(), "glsl")


class Function(Matte):
    def returned(self, wo: Any, wi: Any, pdf: Any) -> Any:
        return super().returned(wo, wi, pdf)._replace(delta=go.never)


class Vector(Matte):
    def returned(self, wo: Any, wi: Any, pdf: Any) -> Any:
        return super().returned(wo, wi, pdf)._replace(delta=go.never(wo))


class Tuple(Matte):
    def returned(self, wo: Any, wi: Any, pdf: Any) -> Any:
        return tuple(super().returned(wo, wi, pdf))


@pytest.mark.parametrize(
    ("material", "text"), [(Function, "delta is a function"), (Vector, "delta is a vector"), (Tuple, "returned tuple")]
)
def test_another_result_is_an_error_that_says_what_to_return(material: type[go.BSDF], text: str) -> None:
    with pytest.raises(go.InputError, match=text) as caught:
        material().sample(WO, U)
    assert "go.never(pdf)" in str(caught.value) or "go.Sample(wi" in str(caught.value)
