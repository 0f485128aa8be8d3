"""The law of gradients at a kink: a slope between those of both sides is right, any other is wrong."""

from __future__ import annotations

import gonio as go
import pytest
from gonio import ops
from gonio.ops import backend
from gonio.verify import verify


class Roof(go.Lambert):
    """Its value has a kink where `ridge` is .5, which it is."""

    ridge: go.Number = go.number(0.5, "place", low=0.0, high=1.0)
    factor = 1.0  # of the slope that autodiff sees

    def eval(self, wo, wi, mode="radiance"):  # type: ignore[no-untyped-def]
        height = self.factor * ops.where(self.ridge >= 0.5, self.ridge - 0.5, 0.5 - self.ridge)
        if self.factor != 1.0 and backend.is_drjit(height):  # the value stays as it is, the slope does not
            height = height + backend.drjit().detach(height) * (1.0 / self.factor - 1.0)
        return super().eval(wo, wi, mode) * (1.0 - height)


class Steep(Roof):
    factor = 3.0


@pytest.mark.parametrize(("material", "holds"), [(Roof, True), (Steep, False)])
def test_a_kink_at_the_given_value(material: type[go.BSDF], holds: bool) -> None:
    found = verify(material(), quick=True, law=["gradients"])["gradients"]
    assert found.failed != holds, found


def test_a_parameter_is_not_called_tested_where_every_pair_has_a_kink() -> None:
    found = verify(Roof(), quick=True, law=["gradients"])["gradients"]
    (note,) = [note for note in found.notes if note.startswith("tested: ")]
    assert "ridge" not in note.partition(";")[0] and note.endswith("the value of ridge for every direction pair")
