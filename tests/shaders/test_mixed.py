"""A tree of both microfacet materials is one shader, without a function that is written twice."""

from __future__ import annotations

import re

import gonio as go
import pytest


@pytest.mark.sample(1)
@pytest.mark.parametrize("lang", ["glsl", "wgsl", "hlsl"])
def test_a_mix_of_metal_and_glass_has_each_function_once(lang: str) -> None:
    text = go.emit(go.mix(go.Conductor(alpha=0.3), go.Dielectric(1.5, 0.2), 0.3), lang)
    heads = re.findall(r"^(?:fn )?[\w<>]*\s?\w+\([^)]*\)(?: -> [\w<>]+)? {$", text, re.MULTILINE)
    assert len(heads) > 10 and len(heads) == len(set(heads))
