"""Mutations of emitted shader text that the law `shader` catches, without a GPU and without a browser.

    python benchmarks/mutations.py [--count 200] [--seed 1]

Each mutation changes an operator, a constant, two arguments or a term in one place of a material's text in GLSL, HLSL
or WGSL. A mutation that the law accepts is compared again on a hundred times as many pairs: if no value differs, it
counts as having no effect (`max(x, 1e-30)` with another constant), otherwise as missed.
"""

from __future__ import annotations

import argparse
import collections
import dataclasses
import os
import sys
from pathlib import Path

import gonio as go
import numpy as np
from gonio.errors import GonioError
from gonio.shaders import Bundle, bundle
from gonio.shaders.read_back import LANGUAGES, Original
from gonio.verify.laws.shader import PAIRS, TOLERANCE, inputs

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests/shaders"))
from mutations import mutations

MATERIALS = {
    "gold": go.Conductor.preset("Au", alpha=(0.3, 0.1), rotation=0.4),
    "glass": go.Dielectric(1.5, 0.3),
    "beckmann": go.Conductor(alpha=0.2, ndf="beckmann", masking="smith-separable", fresnel="schlick"),
    "disney": go.model("disney")(roughness=0.4, sheen=0.5, clearcoat=0.5),
    "eon": go.model("eon")(0.5, 0.6),
    "turquin": go.Turquin(go.Conductor.preset("Au", alpha=0.3)),
}
CLOSER = 100  # multiple of the law's number of pairs


def main(count: int, seed: int) -> None:
    """Print the numbers of mutations caught, without effect and missed, and the CPU time of the law."""
    found: collections.Counter[str] = collections.Counter()
    spent = 0.0
    cases = [(name, language) for name in MATERIALS for language in LANGUAGES]
    for place, (name, language) in enumerate(cases):
        began = _seconds()
        material = MATERIALS[name]
        made = bundle(material, language)
        original = Original(material, made, *inputs(material, PAIRS, seed), seed)
        clean = max(one.figure for one in original.difference(made))
        assert clean <= TOLERANCE, (name, language, clean)
        share = count * (place + 1) // len(cases) - count * place // len(cases)
        changed = mutations(made.text, share, seed + place)
        accepted = [one for one in changed if not _caught(original, made, one.text)]
        spent += _seconds() - began
        found["caught"] += len(changed) - len(accepted)
        for one in accepted:
            dense = Original(material, made, *inputs(material, CLOSER * PAIRS, seed + 1), seed + 1)
            word = "MISSED" if _caught(dense, made, one.text) else "without effect"
            found[word] += 1
            print(f"{word}: {name} in {language}, line {one.line}, {one.kind}: {one.before!r} -> {one.after!r}")
    words = ", ".join(f"{number} {word}" for word, number in found.items())
    print(f"{sum(found.values())} mutations: {words}; the law took {spent:.1f} s of processor time")


def _seconds() -> float:
    """CPU time of this process and of the compilers that it started, which excludes other programs."""
    used = os.times()
    return used.user + used.system + used.children_user + used.children_system


def _caught(original: Original, made: Bundle, text: str) -> bool:
    """Whether the law fails: a value differs, or the text is not valid."""
    try:
        figures = original.difference(dataclasses.replace(made, text=text))
    except GonioError:
        return True
    return bool(np.max([one.figure for one in figures]) > TOLERANCE)


if __name__ == "__main__":
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--count", type=int, default=200)
    options.add_argument("--seed", type=int, default=1)
    given = options.parse_args()
    main(given.count, given.seed)
