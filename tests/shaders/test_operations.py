"""The number of operations of a shader, in its head and in its manifest."""

from __future__ import annotations

import gonio as go
import pytest
from gonio import ops
from gonio.shaders import bundle


class Small(go.BSDF):
    """A surface whose operations can be counted by hand."""

    color: tuple[float, float, float] = go.spectrum((0.5, 0.4, 0.3), "a color")

    def eval(self, wo, wi, mode="radiance"):  # type: ignore[no-untyped-def]
        """color sqrt(wo.wi) / wi.z, where wi is above."""
        return ops.where(wi.z > 0.0, self.color * (ops.sqrt(ops.dot(wo, wi)) / wi.z), 0.0)


def test_operations_are_counted_per_component() -> None:
    made = bundle(Small(), functions=["eval"])
    expected = {"arithmetic": 5 + 3, "divisions": 1, "functions": 1, "selections": 1 + 3, "lookups": 0}
    assert made.manifest["operations"] == {"eval": expected}
    text = " ".join(line.removeprefix("// ") for line in made.text.splitlines())
    assert "Small_eval 14 (8 arithmetic, 1 divisions, 1 functions, 4 selections)." in text


@pytest.mark.parametrize(("fresnel", "most"), [("exact", 224), ("schlick", 140)])
def test_the_cost_that_the_documentation_states(fresnel: str, most: int) -> None:
    counts = bundle(go.Conductor(fresnel=fresnel), functions=["eval"]).manifest["operations"]["eval"]
    assert sum(counts.values()) == most
