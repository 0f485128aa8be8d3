"""The answers do not depend on how a renderer asks."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gonio as go
import numpy as np
import pytest
from gonio import ops
from gonio.ops import backend
from gonio.verify import verify
from gonio.verify.laws import calls

PLUGIN = """
import drjit as dr
import gonio.mitsuba
import mitsuba as mi

class Matte(mi.BSDF):
    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        flags = mi.BSDFFlags.DiffuseReflection | mi.BSDFFlags.FrontSide
        self.m_components, self.m_flags = [flags], flags

    def eval(self, ctx, si, wo, active=True):
        asked = ctx.is_enabled(mi.BSDFFlags.DiffuseReflection, 0)
        lit = (si.wi.z > 0) & (wo.z > 0) & active & asked
        return dr.select(lit, mi.Color3f(0.5 * dr.inv_pi * wo.z), mi.Color3f(0))

    def pdf(self, ctx, si, wo, active=True):
        asked = ctx.is_enabled(mi.BSDFFlags.DiffuseReflection, 0)
        return dr.select((si.wi.z > 0) & (wo.z > 0) & active & asked, dr.inv_pi * wo.z, mi.Float(0))

    def eval_pdf(self, ctx, si, wo, active=True):
        return self.eval(ctx, si, wo, active) * FACTOR, self.pdf(ctx, si, wo, active)

    def sample(self, ctx, si, u1, u2, active=True):
        bs = dr.zeros(mi.BSDFSample3f, dr.width(si.wi))
        bs.wo = mi.warp.square_to_cosine_hemisphere(u2)
        bs.pdf, bs.eta = self.pdf(ctx, si, bs.wo, active), 1.0
        bs.sampled_type, bs.sampled_component = mi.UInt32(+mi.BSDFFlags.DiffuseReflection), mi.UInt32(0)
        return bs, dr.select(bs.pdf > 0, mi.Color3f(0.5), mi.Color3f(0))

mi.register_bsdf("NAME", lambda props: Matte(props))
"""


class OfTheBatch(go.Lambert):
    """Normalized by the brightest of all rays that are asked together."""

    def eval(self, wo: Any, wi: Any, mode: str = "radiance") -> Any:
        if backend.is_drjit(wi):
            largest = backend.drjit().max(wi.z)
            return super().eval(wo, wi, mode) * (1.0 / ops.maximum(largest, 0.1))
        return super().eval(wo, wi, mode)


class SaysOpaque(go.Dielectric):
    """Glass that declares to let nothing through."""

    @property
    def transmits(self) -> bool:
        return False


def test_an_answer_that_depends_on_the_batch_is_caught() -> None:
    verdict = verify(OfTheBatch(), quick=True, law="calls")["calls"]
    assert verdict.failed and any(line.startswith("one ray per call") for line in verdict.why)


def test_a_declared_fact_is_held_to() -> None:
    why = verify(SaysOpaque(alpha=0.3), quick=True, law="calls")["calls"].why
    assert any("`transmits` is False" in line for line in why), why


@pytest.mark.sample(1)
@pytest.mark.parametrize("material", [go.Lambert(), go.Dielectric(alpha=0.2), go.Conductor(alpha=0.01), go.Mirror()])
def test_sound_materials_pass(material: go.BSDF) -> None:
    assert verify(material, quick=True, law="calls")["calls"].status == "pass"


@pytest.mark.slow
def test_a_plugin_in_a_file_is_judged_by_what_path_tracers_call(tmp_path: Path) -> None:
    for name, factor in (("calls_sound", "1.0"), ("calls_wrong", "2.0")):
        (tmp_path / f"{name}.py").write_text(PLUGIN.replace("NAME", name).replace("FACTOR", factor))
    assert verify(f"{tmp_path}/calls_sound.py:calls_sound", quick=True).passed
    verdict = verify(f"{tmp_path}/calls_wrong.py:calls_wrong", quick=True, law="calls")["calls"]
    assert verdict.failed and "eval_pdf's value differs from eval: it is 2 times as large" in verdict.why[0]
    assert verdict.grade == "broken" and "2" in verdict.cause


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    ("right", "wrong", "words"),
    [
        ("& active & asked, dr.inv_pi * wo.z", "& active & asked, dr.inv_pi * si.to_local(wo).z", "pdf on a rotated"),
        ("mi.Color3f(0.5), mi.Color3f(0))", "mi.Color3f(si.uv.x), mi.Color3f(0))", "eval with other si.uv"),
    ],
)
def test_a_plugin_is_asked_on_tilted_and_textured_surfaces(tmp_path: Path, right: str, wrong: str, words: str) -> None:
    name = "calls_" + words.split()[-1].replace(".", "_")
    assert right in PLUGIN
    text = PLUGIN.replace(right, wrong).replace("NAME", name).replace("FACTOR", "1.0")
    (tmp_path / f"{name}.py").write_text(text)
    verdict = verify(f"{tmp_path}/{name}.py:{name}", quick=True, law="calls")["calls"]
    assert verdict.failed and words in " ".join(verdict.why), verdict.why


@pytest.mark.slow
def test_a_sample_of_weight_0_with_the_stated_density_has_not_failed(tmp_path: Path) -> None:
    text = PLUGIN.replace("& active & asked\n", "& active & asked & (wo.z > 0.5)\n")
    text = text.replace("return bs, dr.select(bs.pdf > 0,", "return bs, dr.select((bs.pdf > 0) & (bs.wo.z > 0.5),")
    assert text.count("0.5)") > PLUGIN.count("0.5)") + 1
    (tmp_path / "ring.py").write_text(text.replace("NAME", "calls_ring").replace("FACTOR", "1.0"))
    assert not verify(f"{tmp_path}/ring.py:calls_ring", quick=True, law="pdf").failures


class RedAboveBlueBelow(go.BSDF):
    """A sheet that is printed on both sides."""

    @property
    def back_differs(self) -> bool:
        return True

    def eval(self, wo: Any, wi: Any, mode: str = "radiance") -> Any:
        color = ops.where(wo.z > 0.0, ops.vec3(0.8, 0.1, 0.1), ops.vec3(0.1, 0.1, 0.8))
        return color * ops.where(wo.z * wi.z > 0.0, ops.abs(wi.z) * ops.inv_pi, 0.0)


@pytest.mark.slow
def test_a_surface_may_declare_another_color_on_its_back() -> None:
    assert verify(RedAboveBlueBelow(), quick=True, law=["calls"]).passed
    undeclared = type("Undeclared", (RedAboveBlueBelow,), {"back_differs": False})
    assert "`back_differs`" in " ".join(verify(undeclared(), quick=True, law=["calls"])["calls"].why)
    assert not go.two_sided(go.Lambert()).back_differs
    assert go.mix(go.Lambert(), RedAboveBlueBelow(), 0.5).back_differs


def test_a_denormal_number_that_is_0_in_another_kernel_is_no_difference() -> None:
    wo = wi = np.array([[0.0, 0.0, 1.0]])
    for value, differs in ((1e-38, False), (1e-20, True)):
        first, second = {"eval": np.array([[0.0, 0.0, value]])}, {"eval": np.zeros((1, 3))}
        assert bool(calls._unlike("one ray per call", first, second, wo, wi, 1e-4).wrong) == differs
