"""Draw the figures of docs/course for Homework 4: tables of E, masking terms, the added lobe, the two rows of balls.

python docs/make_course_homework.py [NAME ...]
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import Any

import gonio as go
import numpy as np
from make_course_figures import BLUE, GOLD, GREEN, RED, ROOT, canvas, draw, encoded, label, save


def tables(name: str, panels: Sequence[tuple[str, np.ndarray]], height: float = 3.0) -> None:
    """Draw tables [roughness, mu] as gray values, lowest roughness at the bottom."""
    figure, axes = canvas(len(panels), 2.75 * len(panels), height)
    for axis, (title, values) in zip(axes, panels, strict=True):
        axis.imshow(
            values, cmap="gray", vmin=0.0, vmax=1.0, origin="lower", extent=(0, 1, 0, 1), interpolation="nearest"
        )
        axis.set_title(title, fontsize=9, loc="left")
        label(axis, r"$\mu = n\cdot o$", "roughness" if axis is axes[0] else "", legend=False)
    save(figure, name)


def table(masking: str, **options: Any) -> np.ndarray:
    """E of GGX with F = 1, 64 x 64."""
    return np.asarray(go.bake("ggx", masking=masking, resolution=64, lut=["E"], **options).arrays["E"])


def cosine_sampling() -> None:
    """E by cosine-weighted sampling, as in the homework's picture, and without noise."""
    noisy = table("schlick-ibl", method="cosine", sampler="stratified", samples=1024, floor=1e-4)
    tables(
        "cosine-sampling.png",
        [
            ("1,024 cosine-weighted", np.floor(noisy * 255) % 256 / 255),
            ("exact, $k = \\alpha/2$ (figures)", table("schlick-ibl")),
            ("exact, $k = (r+1)^2/8$ (text)", table("schlick-direct")),
            ("exact, Smith", table("smith-correlated")),
        ],
    )


def importance_sampling() -> None:
    """E from 64 directions per texel, cosine-weighted or by GGX normals; and the errors over the number of samples."""
    figure, axes = canvas(3, 9.4, 3.1)
    for axis, (title, method) in zip(
        axes, (("cosine, N = 64", "cosine"), ("GGX normals, N = 64", "ggx")), strict=False
    ):
        values = table("schlick-ibl", method=method, samples=64, sampler="independent")
        axis.imshow(values, cmap="gray", vmin=0, vmax=1, origin="lower", extent=(0, 1, 0, 1), interpolation="nearest")
        axis.set_title(title, fontsize=9, loc="left")
        label(axis, r"$\mu$", "roughness", legend=False)
    exact = table("schlick-ibl")
    counts = 2 ** np.arange(4, 13, 2)
    for method, sampler, color, words in (
        ("cosine", "independent", RED, "cosine"),
        ("ggx", "independent", BLUE, "GGX normals"),
        ("ggx", "hammersley", GREEN, "GGX normals, Hammersley"),
    ):
        rms = []
        for count in counts:
            error = table("schlick-ibl", method=method, samples=int(count), sampler=sampler) - exact
            rms.append(np.sqrt(np.mean(error[13:] ** 2)))  # roughness above 0.2, where cosine sampling finds the lobe
        axes[2].loglog(counts, rms, ".-", color=color, label=words)
    axes[2].set_title("rms error, roughness > 0.2", fontsize=9, loc="left")
    label(axes[2], "N", "error of E")
    save(figure, "importance-sampling.png")


def average() -> None:
    """E_avg as a picture and as curves."""
    figure, (picture, axis) = canvas(2, 7.2, 3.1, width_ratios=(1, 1.7))
    styles = (
        ("schlick-ibl", BLUE, "$k = \\alpha/2$ (figures)"),
        ("schlick-direct", RED, "$k = (r+1)^2/8$ (text)"),
        ("smith-correlated", GREEN, "Smith"),
    )
    for masking, color, words in styles:
        baked = go.bake("ggx", masking=masking, resolution=64, lut=["E", "Eavg"])
        values = np.asarray(baked.arrays["E_avg"])
        axis.plot((np.arange(64) + 0.5) / 64, values, color=color, label=words)
        if masking == "schlick-ibl":
            picture.imshow(
                np.repeat(values[:, None], 64, 1), cmap="gray", vmin=0, vmax=1, origin="lower", extent=(0, 1, 0, 1)
            )
    axis.set_ylim(0, 1.02)
    picture.set_title("E_avg.png", fontsize=9, loc="left")
    label(picture, "constant along a row", "roughness", legend=False)
    label(axis, "roughness", r"$E_{avg}$")
    save(figure, "average.png")


def split_sum() -> None:
    """The two factors of the split sum: the one that multiplies Schlick's R0, and the constant one."""
    baked = go.bake("ggx", masking="smith-correlated", resolution=64, lut=["dfg"])
    dfg = np.asarray(baked.arrays["dfg"])
    scale, bias = dfg[..., 0], dfg[..., 1]
    tables(
        "split-sum.png", [("scale $A$ (of $R_0$)", scale), ("bias $B$", bias), ("$A + B = E$ at $F = 1$", scale + bias)]
    )


def masking() -> None:
    """G1 with the two forms of k and by Smith, and the resulting lobes."""
    figure, axes = canvas(3, 10.0, 3.0)
    mu = np.linspace(0.0, 1.0, 201)
    for axis, roughness in zip(axes, (0.1, 0.5, 1.0), strict=True):
        alpha = roughness**2
        for k, color, words in (
            (alpha / 2, BLUE, "$k = \\alpha/2$ (figures)"),
            ((roughness + 1) ** 2 / 8, RED, "$k = (r+1)^2/8$ (text)"),
        ):
            axis.plot(mu, mu / (mu * (1 - k) + k), color=color, label=words)
        tan2 = (1 - mu[1:] ** 2) / mu[1:] ** 2
        axis.plot(mu[1:], 2 / (1 + np.sqrt(1 + alpha**2 * tan2)), color=GREEN, ls="--", label="Smith")
        axis.set_title(f"roughness {roughness:g}", fontsize=9, loc="left")
        axis.set_ylim(0, 1.03)
        label(axis, r"$n\cdot v$", r"$G_1$", legend=axis is axes[0])
    save(figure, "masking.svg")


def kulla_conty() -> None:
    """The albedo of the two terms with F = 1, and f_add as a function of F_avg."""
    figure, (left, right) = canvas(2, 8.4, 3.2)
    mu = np.linspace(0.05, 1.0, 20)
    plain = go.Conductor(alpha=0.8, fresnel="one")
    micro = np.asarray(go.albedo(plain, mu=mu).value)[:, 0]
    whole = np.asarray(go.albedo(go.KullaConty(plain), mu=mu).value)[:, 0]
    left.fill_between(mu, 0, micro, color=BLUE, alpha=0.25, lw=0)
    left.fill_between(mu, micro, whole, color=RED, alpha=0.25, lw=0)
    left.plot(mu, micro, color=BLUE, label=r"$E(\mu)$: $f_{micro}$")
    left.plot(mu, whole, color=RED, label=r"with $f_{ms}$")
    left.set_ylim(0, 1.08)
    left.set_title(r"$\alpha = 0.8,\ F = 1$", fontsize=9, loc="left")
    label(left, r"$\mu$", "albedo")
    f = np.linspace(0.0, 1.0, 101)
    for e, color in ((0.9, BLUE), (0.7, GOLD), (0.5, RED)):
        right.plot(f, f * e / (1 - f * (1 - e)), color=color, label=f"sheet, $E_{{avg}}$ = {e:g}")
        right.plot(f, f * f * e / (1 - f * (1 - e)), color=color, ls="--")
    right.plot([], [], color="black", ls="--", label="bounce (from the second)")
    label(right, r"$F_{avg}$", r"$f_{add}$")
    save(figure, "kulla-conty.svg")


def two_rows() -> None:
    """Silver with the homework's terms under one directional light: compensated above, plain below."""
    figure, axes = canvas(2, 11.0, 2.9)
    panels = (
        ("$k = (r+1)^2/8$ (text): a false rim at the right", "schlick-direct"),
        ("$k = \\alpha/2$ (figures)", "schlick-ibl"),
    )
    scene = str(ROOT / "examples" / "shading-balls")
    for axis, (title, masking) in zip(axes, panels, strict=True):
        picture = go.render(scene, overrides=_rows(masking), integrator="direct", size=(760, 315), spp=64)
        axis.imshow(encoded(picture))
        axis.set_title(title, fontsize=9, loc="left")
        axis.axis("off")
    save(figure, "two-rows.jpg")


def _rows(masking: str) -> dict[str, object]:
    """Materials of the ten balls, roughness increasing to the left, and the light."""
    changes: dict[str, object] = {
        "lights.0.radiance": [0.0, 0.0, 0.0],
        "lights.1": {"type": "directionalLight", "direction": [0.5, -0.55, -1.0], "energy": [3.0, 3.0, 3.0]},
    }
    for column, roughness in enumerate((0.95, 0.75, 0.55, 0.35, 0.15)):
        base = go.Conductor.preset("Ag", alpha=roughness**2, masking=masking, fresnel="schlick")
        changes[f"shapes.{column}.material"] = go.KullaConty(base, color="sheet", average="imageworks")
        changes[f"shapes.{column + 5}.material"] = base
    return changes


if __name__ == "__main__":
    sys.exit(draw((cosine_sampling, importance_sampling, average, split_sum, masking, kulla_conty, two_rows)))
