"""Delta lobes are judged like any other."""

from __future__ import annotations

from typing import Any, ClassVar

import gonio as go
import pytest
from gonio import ops
from gonio.verify import verify


class NoRadianceFactor(go.Dielectric):
    """Smooth glass whose radiance is not divided by eta^2."""

    def sample(self, wo: Any, u: Any, mode: str = "radiance") -> Any:
        return super().sample(wo, u, "importance")


class FactorInPower(go.Dielectric):
    """Smooth glass whose power is divided by eta^2 too."""

    def sample(self, wo: Any, u: Any, mode: str = "radiance") -> Any:
        return super().sample(wo, u, "radiance")


class ModesExchanged(go.Dielectric):
    """Smooth glass that takes one mode for the other."""

    def sample(self, wo: Any, u: Any, mode: str = "radiance") -> Any:
        return super().sample(wo, u, "importance" if mode == "radiance" else "radiance")


class BentTheWrongWay(go.Dielectric):
    """Smooth glass that refracts by 1 / eta."""

    def sample(self, wo: Any, u: Any, mode: str = "radiance") -> Any:
        s = super().sample(wo, u, mode)
        through = wo.z * s.wi.z < 0.0
        x, y = -wo.x * s.eta, -wo.y * s.eta
        z = ops.sqrt(ops.maximum(1.0 - x * x - y * y, 0.0))
        bent = ops.vec3(x, y, ops.copysign(z, s.wi.z))
        fine = through & (x * x + y * y < 1.0)
        return s._replace(wi=ops.where(fine, bent, s.wi))


class DimmerFromBehind(go.Mirror):
    """A mirror that reflects less along one azimuth."""

    def sample(self, wo: Any, u: Any, mode: str = "radiance") -> Any:
        s = super().sample(wo, u, mode)
        return s._replace(weight=s.weight * ops.where(wo.x > 0.0, 1.0, 0.5))


class DimmerAtGrazing(go.Dielectric):
    """Smooth glass that loses light by the cosine outside, both ways alike, which no stain does."""

    def sample(self, wo: Any, u: Any, mode: str = "radiance") -> Any:
        s = super().sample(wo, u, mode)
        outside = ops.minimum(ops.abs(wo.z), ops.abs(s.wi.z))
        return s._replace(weight=s.weight * ops.where(wo.z * s.wi.z < 0.0, 0.7 + 0.3 * outside, 1.0))


class BesideTheMirror(go.Mirror):
    """Orders of a grating close to the mirror direction: one at -0.02, or two at -0.02 and 0.02."""

    orders: ClassVar[int] = 1

    def sample(self, wo: Any, u: Any, mode: str = "radiance") -> Any:
        first = (u.x < 0.5) | (self.orders == 1)
        x = ops.where(first, -0.02, 0.02) - wo.x
        z2 = 1.0 - x * x - wo.y * wo.y
        valid = (wo.z > 0.0) & (z2 > 0.0)
        pdf = ops.where(valid, 1.0 / self.orders, 0.0)
        wi = ops.vec3(x, -wo.y, ops.sqrt(ops.maximum(z2, 0.0)))
        s = super().sample(wo, u, mode)
        return s._replace(
            wi=ops.where(valid, wi, s.wi), pdf=pdf, delta=valid, weight=s.weight * ops.where(valid, 1.0, 0.0)
        )

    @property
    def isotropic(self) -> bool:
        return False


class TwoOrders(BesideTheMirror):
    orders = 2


@pytest.mark.parametrize(("kind", "failed"), [(BesideTheMirror, True), (TwoOrders, False)])
def test_lobes_on_both_sides_of_the_mirror_direction_are_a_grating(kind: type[go.BSDF], failed: bool) -> None:
    for seed in (1, 2):
        verdict = verify(kind(), quick=True, law="delta", seed=seed)["delta"]
        assert verdict.failed == failed, verdict.why
        assert failed == ("close to the mirror direction" in " ".join(verdict.why))


def test_light_that_is_lost_on_the_way_is_lost_by_beers_law() -> None:
    verdict = verify(DimmerAtGrazing(alpha=0.0), quick=True, law="delta")["delta"]
    assert verdict.failed and "but Fresnel's equations" in " ".join(verdict.why), verdict.why


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    ("mistake", "why", "cause"),
    [
        (NoRadianceFactor(alpha=0.0), "1 times as much radiance as power", "the factor 1 / eta^2 is missing"),
        (FactorInPower(alpha=0.0), "1 times as much radiance as power", "power has the factor 1 / eta^2"),
        (ModesExchanged(alpha=0.0), "as much radiance as power", "the two modes are exchanged"),
        (BentTheWrongWay(alpha=0.0), "not refracted according to Snell's law", "Snell's law holds for 1 / eta"),
        (DimmerFromBehind(), "the light of the lobe changes when wo rotates", ""),
    ],
    ids=lambda value: type(value).__name__ if isinstance(value, go.BSDF) else None,
)
def test_a_mistake_is_named(mistake: go.BSDF, why: str, cause: str) -> None:
    verdict = verify(mistake, quick=True, law="delta")["delta"]
    assert verdict.failed and any(why in line for line in verdict.why), verdict.why
    assert cause in verdict.cause and verdict.grade == "broken"


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    "sound",
    [
        go.Mirror(0.8),
        go.Dielectric(1.5, 0.0),
        go.Dielectric(0.7, 0.0, albedo=(0.2, 0.5, 0.9)),
        go.Dielectric(1.0, 0.0),
        go.mix(go.Mirror(), go.OrenNayar(0.7, 0.2), 0.6),
    ],
    ids=str,
)
def test_sound_lobes_pass(sound: go.BSDF) -> None:
    verdict = verify(sound, quick=True, law="delta")["delta"]
    assert verdict.status == "pass", verdict.why


def test_a_material_without_one_is_not_asked() -> None:
    assert verify(go.Lambert(), quick=True, law="delta")["delta"].status == "does not apply"
