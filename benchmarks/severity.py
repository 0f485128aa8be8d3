"""Stated bias compared with rendered bias: the effect of a mistake on a picture, as `gonio verify` states it and as
rendered.

    python benchmarks/severity.py [--size 64] [--spp 256]

For each wrong material, a ball is rendered with an orthographic camera: its disk covers the hemisphere of wo weighted
by the cosine, as in the stated average. Three pictures are each compared with one by a correct estimator:

    furnace   a constant environment of radiance 1, by BSDF sampling only, and with light sampling (MIS)
    lit       a lamp of half a steradian, or 24 distant ones if the compared values differ in sign

Prints the stated and the rendered bias and their ratio; the limit is a factor of 1.5.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gonio as go
import gonio.mitsuba
import mitsuba as mi
import numpy as np
from gonio.material import BSDF
from gonio.verify.severity import Bias

TESTS = Path(__file__).resolve().parents[1] / "tests"
sys.path[:0] = [str(TESTS), str(TESTS / "verify")]

import test_causes  # noqa: E402
import test_severity  # noqa: E402

from broken import facets, surfaces  # noqa: E402

BAR = 1.5
_names: dict[type, str] = {}
_z = 1.0 - 2.0 * (np.arange(24) + 0.5) / 24  # evenly distributed over the sphere, by the golden angle
_phi = 2.39996 * np.arange(24)
_suns = np.stack([np.sqrt(1.0 - _z**2) * np.cos(_phi), np.sqrt(1.0 - _z**2) * np.sin(_phi), _z], -1)


def plugin(cls: type[BSDF], **values: Any) -> dict[str, Any]:
    """The material as a Mitsuba plugin."""
    if cls not in _names:
        _names[cls] = go.register(cls).name
    return {"type": f"gonio_{_names[cls].replace('-', '_')}", **values}


def ball(
    bsdf: dict[str, Any], light: dict[str, Any], how: str, size: int, spp: int, turn: float = 0.0, seed: int = 5
) -> np.ndarray:
    """The ball's pixels (N, 3), ring by ring. how: sampling by "bsdf", "light" or "both"."""
    T = mi.ScalarTransform4f
    integrator = {"type": "direct", "emitter_samples": int(how != "bsdf"), "bsdf_samples": int(how != "light")}
    if how == "light" and light["lamp"]["type"] != "directional":
        integrator["emitter_samples"] = 4
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": integrator,
            "sensor": {
                "type": "orthographic",
                "to_world": T().look_at(origin=[0, 0, 5], target=[0, 0, 0], up=[0, 1, 0]),
                "film": {"type": "hdrfilm", "width": size, "height": size, "rfilter": {"type": "box"}},
                "sampler": {"type": "independent", "sample_count": spp},
            },
            "ball": {"type": "sphere", "to_world": T().rotate([0.6, 0.0, 0.8], turn), "bsdf": bsdf},
            **light,
        }
    )
    image = np.asarray(mi.render(scene, spp=spp, seed=seed))[..., :3]
    x = (np.arange(size) + 0.5) / size * 2.0 - 1.0
    square = x[:, None] ** 2 + x[None, :] ** 2
    inside = square < 1.0
    across, up = np.meshgrid(x, x)
    ring, azimuth = np.floor(32.0 * square[inside]), np.arctan2(up, across)[inside]
    return image[inside][np.lexsort((azimuth, ring))]


FURNACE = {"lamp": {"type": "constant"}}


def lamp() -> dict[str, Any]:
    """A disk at 45 degrees that subtends half a steradian."""
    T = mi.ScalarTransform4f
    place = T().look_at(origin=[3, 3, 4], target=[0, 0, 0], up=[0, 1, 0]) @ T().scale([2.3, 2.3, 1.0])
    emitter = {"type": "area", "radiance": {"type": "rgb", "value": [10.0] * 3}}
    return {"lamp": {"type": "disk", "to_world": place, "emitter": emitter}}


def sun(direction: np.ndarray) -> dict[str, Any]:
    return {"lamp": {"type": "directional", "direction": direction.tolist()}}


def apart(a: np.ndarray, b: np.ndarray) -> float:
    """Mean |a - b| divided by mean b, of two pictures."""
    return float(np.nanmean(np.abs(a - b)) / np.nanmean(b))


def patches(a: np.ndarray) -> np.ndarray:
    """Means over neighboring pixels, in which noise cancels."""
    return np.array([part.mean() for part in np.array_split(a.mean(1), max(len(a) // 64, 1))])


def blurred(a: np.ndarray, b: np.ndarray, noise: float = 0.0) -> float:
    """As `apart`, for noisy pictures, by patches; `noise` is the difference between two pictures of the same scene."""
    off = float(np.mean(np.abs(patches(a) - patches(b))) / np.mean(patches(b)))
    return float(np.sqrt(off**2 - noise**2)) if off > 1.5 * noise else 0.0


def lit_otherwise(cls: type[BSDF], other: dict[str, Any], size: int, turn: float = 0.0) -> float:
    """The difference between two materials under 24 distant lamps, one at a time."""
    off, light = 0.0, 0.0
    for direction in _suns:
        a = ball(plugin(cls), sun(direction), "light", size, 4)
        b = ball(other, sun(direction), "light", size, 4, turn)
        off, light = off + float(np.abs(a - b).sum()), light + float(a.sum())
    return off / light


def exchanged(cls: type[BSDF]) -> type[BSDF]:
    """The material with directions swapped: f(wi, wo)."""

    def eval(self: Any, wo: Any, wi: Any, mode: str = "radiance") -> Any:
        return cls.eval(self, wi, wo, mode) * go.ops.safe_div(go.ops.abs(wi.z), go.ops.abs(wo.z))

    return type(f"Exchanged{cls.__name__}", (cls,), {"eval": eval, "__doc__": "The other way round."})


def of_samples(cls: type[BSDF], size: int, spp: int) -> dict[str, float]:
    """The bias of pictures with BSDF sampling, compared with light sampling."""
    found = {}
    for name, light, how, more in (
        ("furnace", FURNACE, "bsdf", 1),
        ("furnace, both", FURNACE, "both", 1),
        ("lit", lamp(), "bsdf", 4),
    ):
        right, again = (ball(plugin(cls), light, "light", size, 4 * spp, seed=seed) for seed in (4, 5))
        first, second = (ball(plugin(cls), light, how, size, more * spp, seed=seed) for seed in (6, 7))
        noise = np.hypot(blurred(first, second), blurred(right, again)) / np.sqrt(2.0)
        found[name] = blurred(first, right, float(noise))
    return found


def of_gain(cls: type[BSDF], size: int, spp: int) -> dict[str, float]:
    """The excess above 1 in a furnace of radiance 1, pixel by pixel."""
    picture = ball(plugin(cls), FURNACE, "light", size, 4 * spp)
    return {"furnace": float(np.maximum(patches(picture) - 1.0, 0.0).mean())}


def of_loss(cls: type[BSDF], size: int, spp: int) -> dict[str, float]:
    picture = ball(plugin(cls), FURNACE, "light", size, 4 * spp)
    return {"furnace": float(np.maximum(1.0 - patches(picture), 0.0).mean())}


def of_reciprocity(cls: type[BSDF], size: int, spp: int) -> dict[str, float]:
    return {"lit": lit_otherwise(cls, plugin(exchanged(cls)), size)}


def of_turning(cls: type[BSDF], size: int, spp: int) -> dict[str, float]:
    return {"lit": float(np.mean([lit_otherwise(cls, plugin(cls), size, turn) for turn in (50.0, 130.0, 250.0)]))}


def of_albedo(cls: type[BSDF], size: int, spp: int) -> dict[str, float]:
    light = sun(np.array([-1.0, -1.0, -2.0]))
    low, high, middle = (
        ball(plugin(cls, albedo={"type": "rgb", "value": [v] * 3}), light, "light", size, 4)
        for v in (0.125, 0.875, 0.3125)
    )
    return {"lit": apart(middle, 0.75 * low + 0.25 * high)}


Render = Callable[[type[BSDF], int, int], dict[str, float]]
MISTAKES: list[tuple[type[BSDF], str, Render]] = [
    *[(cls, "weight", of_samples) for cls in (facets.NoJacobianInSample, facets.AlphaSquaredAgain)],
    (facets.BelowTheHorizon, "weight", of_samples),
    *[(cls, "weight", of_samples) for cls in (test_severity.Brighter, test_causes.TimesSomething, test_causes.Behind)],
    *[(cls, "weight", of_samples) for cls in (test_causes.NoCosineOfTheHalfVector, test_causes.BeyondSixty)],
    *[(cls, "pdf", of_samples) for cls in (facets.HalfVectorPdf, surfaces.HalfTheHemisphere)],
    *[(cls, "pdf", of_samples) for cls in (surfaces.PdfOfTheSphere, surfaces.OtherLobeWeights)],
    *[(cls, "energy", of_gain) for cls in (surfaces.OnePercentMore, facets.UnnormalisedD)],
    (surfaces.RowAverage, "energy", of_loss),
    *[(cls, "reciprocity", of_reciprocity) for cls in (surfaces.CosineTwice, surfaces.OneSidedCoupling)],
    (facets.FresnelAtTheNormal, "reciprocity", of_reciprocity),
    (surfaces.FollowsTheTangent, "isotropy", of_turning),
    (surfaces.AlbedoSquared, "linearity", of_albedo),
]


def stated(cls: type[BSDF], law: str) -> Bias:
    """The stated bias at the material's own values, as used in the renders."""
    from gonio.verify.effort import EFFORTS
    from gonio.verify.laws import laws
    from gonio.verify.subject import of

    if law == "pdf":  # its figures need no chi-square
        from gonio.verify.estimators import sampling_bias

        return sampling_bias(of(cls()), "pdf")
    one, effort = of(cls()), EFFORTS["quick"]
    bias = laws()[law].bias(one, laws()[law].judge(one, effort, 1), effort, 1)
    assert bias is not None, f"{cls.__name__}: {law} states nothing"
    return bias


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--size", type=int, default=64)
    parser.add_argument("--spp", type=int, default=256)
    parser.add_argument("--only", default="", help="names, by commas")
    given = parser.parse_args()
    met, told = 0, 0
    print(f"{'mistake':24} {'law':12} {'grade':10} {'picture':14} {'stated':>8} {'rendered':>9} {'ratio':>6}")
    for cls, law, render in MISTAKES:
        if given.only and cls.__name__ not in given.only.split(","):
            continue
        bias = stated(cls, law)
        for name, rendered in render(cls, given.size, given.spp).items():
            said = bias.average
            if name.startswith("furnace") and bias.furnace is not None and bias.both is not None:
                said = bias.both if name.endswith("both") else bias.furnace
            small = max(said, rendered) < 5e-3  # both are below the noise of a render
            ratio = 1.0 if small else said / max(rendered, 1e-9)
            good = 1.0 / BAR <= ratio <= BAR
            met, told = met + good, told + 1
            print(
                f"{cls.__name__:24} {law:12} {bias.grade:10} {name:14} {said:8.4f} {rendered:9.4f} {ratio:6.2f}"
                f"{'' if good else '   MISSED'}",
                flush=True,
            )
    print(f"within a factor of {BAR}: {met} of {told}")


if __name__ == "__main__":
    main()
