"""Write docs/phong-limits.md and its pictures: the failures of the Phong model, as measured by the verifier.

python docs/make_phong_limits.py
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import gonio as go
import numpy as np
from gonio.energy.albedo import cubature
from gonio.ops import dot, sqr, where
from gonio.optics.frame import mirror
from gonio.verify import Report, directions, subject, verify
from matplotlib.figure import Figure

HERE = Path(__file__).parent
PICTURES = HERE / "phong-limits"
COLORS = ("#b3403a", "#c98a2b", "#3f7d4f", "#2b5d8a")


class EvenPower(go.Phong):
    """Phong with a common error: pow(dot(v, r), 4) without max(0, ...)."""

    def eval(self, wo: Any, wi: Any, mode: str = "radiance") -> Any:
        above = (wo.z > 0.0) & (wi.z > 0.0)
        base = dot(wo, mirror(wi))
        return self.kd * where(above, wi.z, 0.0) + self.ks * where(above, sqr(sqr(base)), 0.0)


class NoHorizon(go.Phong):
    """Phong without a test of the sign of n.l: the highlight of a light below the surface shines through."""

    def eval(self, wo: Any, wi: Any, mode: str = "radiance") -> Any:
        base = dot(wo, mirror(wi))
        seen = wo.z > 0.0
        return self.kd * where(seen, wi.z, 0.0) + self.ks * where(seen, go.ops.pow(base, self.p), 0.0)


def plane(theta: np.ndarray) -> np.ndarray:
    """Directions in the plane of incidence, for theta from -180 to 180 degrees."""
    t = np.radians(theta)
    return np.stack([np.sin(t), 0.0 * t, np.cos(t)], -1)


def canvas(columns: int = 1, height: float = 3.2) -> tuple[Figure, Any]:
    figure = Figure(figsize=(4.9 * columns, height), layout="constrained")
    axes = np.atleast_1d(figure.subplots(1, columns))
    for axis in axes:
        axis.spines[["top", "right"]].set_visible(False)
        axis.tick_params(labelsize=10)
    return figure, axes


def save(figure: Figure, name: str) -> None:
    figure.savefig(PICTURES / f"{name}.svg", metadata={"Date": None})


def slice_of(model: go.BSDF, view: float, theta: np.ndarray) -> np.ndarray:
    """eval in the plane of incidence for a viewer at `view` degrees."""
    wo = np.tile(plane(np.array([view])), (len(theta), 1))
    return np.asarray(model.eval(wo, plane(theta), precision="float64")).mean(1)  # type: ignore[call-arg]


def verdict(report: Report, law: str) -> str:
    v = report[law]
    text = "; ".join(w.replace(str(HERE.parent), ".") for w in v.why) or v.shown
    return f"**{law}: {v.status}** ({text})"


def even_power() -> str:
    theta = np.linspace(-89.9, 89.9, 721)
    figure, (axis,) = canvas()
    sound, typed = go.Phong(kd=0.0, ks=0.5, p=4.0), EvenPower(kd=0.0, ks=0.5, p=4.0)
    axis.plot(theta, slice_of(typed, 60.0, theta), color=COLORS[0], label="pow(v.r, 4)")
    axis.plot(theta, slice_of(sound, 60.0, theta), color=COLORS[3], label="pow(max(0, v.r), 4)")
    axis.axvline(60.0, color="#888", lw=0.8, ls=":")
    axis.text(58.0, 0.42, "viewer", ha="right", fontsize=10, color="#666")
    axis.set_xlabel("angle of the light, degrees", fontsize=11)
    axis.set_ylabel("reflected, light of intensity 1", fontsize=11)
    axis.legend(frameon=False, fontsize=10)
    save(figure, "even-power")
    report = verify(typed, quick=True, law=["pdf"])
    return verdict(report, "pdf")


def below() -> str:
    theta = np.linspace(-180.0, 180.0, 1441)
    figure, (axis,) = canvas()
    axis.axvspan(-180, -90, color="#000", alpha=0.05)
    axis.axvspan(90, 180, color="#000", alpha=0.05)
    for model, color, label in (
        (NoHorizon(kd=0.3, ks=0.5, p=8.0), COLORS[0], "no test"),
        (go.Phong(kd=0.3, ks=0.5, p=8.0), COLORS[3], "0 where n.l < 0"),
    ):
        axis.plot(theta, slice_of(model, 75.0, theta), color=color, label=label)
    axis.axhline(0.0, color="#888", lw=0.6)
    axis.set_xlabel("angle of the light, degrees (grey: below the surface)", fontsize=11)
    axis.set_ylabel("reflected", fontsize=11)
    axis.legend(frameon=False, fontsize=10)
    save(figure, "below")
    return verdict(verify(NoHorizon(kd=0.3, ks=0.5, p=8.0), quick=True, law=["positivity"]), "positivity")


def reflected_power(model: go.BSDF, theta: np.ndarray) -> np.ndarray:
    """Power reflected in all directions, divided by the incident power of a parallel beam at angle theta."""
    one = subject.of(model)

    def leaving(light: np.ndarray, view: np.ndarray) -> np.ndarray:
        return one.eval(view, light) / light[:, 2:] * np.maximum(view[:, 2:], 0.0)

    return cubature.integrate(one.sample, cubature.of_rows(leaving), directions.at(theta, 0.0), 1e-4).value.mean(1)


def energy() -> tuple[str, list[str]]:
    theta = np.array([0.0, 15, 30, 45, 55, 65, 72, 78, 82, 85, 87])
    figure, axes = canvas(2)
    rows = []
    for p, color in zip((1.0, 4.0, 16.0, 64.0), COLORS, strict=True):
        model = go.Phong(kd=0.0, ks=1.0, p=p)
        report = verify(model, quick=True, law=["energy", "reciprocity"])
        curves = report["energy"].evidence
        angle = directions.angles(curves.wo)[:, 0]
        order = np.argsort(angle)
        axes[0].plot(angle[order], curves.quadrature[order].mean(1), color=color, label=f"p = {p:g}")
        power = reflected_power(model, theta)
        axes[1].plot(theta, power, color=color, label=f"p = {p:g}")
        v = report["energy"]
        most = float(curves.quadrature.max())
        rows.append(
            f"| {p:g} | {most:.3f} | {power[0]:.3f} | {power[-1]:.2f} | {v.status} | {report['reciprocity'].status} |"
        )
    words = (
        ("white light from everywhere", "angle of the viewer, degrees", "radiance toward the viewer"),
        ("a beam from one direction", "angle of the light, degrees", "reflected / incident power"),
    )
    for axis, (title, across, up) in zip(axes, words, strict=True):
        axis.axhline(1.0, color="#888", lw=0.8, ls=":")
        axis.set_xlabel(across, fontsize=11)
        axis.set_ylabel(up, fontsize=11)
        axis.set_title(title, fontsize=11, loc="left")
        axis.legend(frameon=False, fontsize=10)
    axes[1].set_yscale("log")
    save(figure, "energy")
    return "", rows


def reciprocity() -> str:
    model = go.Phong()
    report = verify(model, quick=True, law=["reciprocity"])
    figure, axes = canvas(1, 4.0)
    image = axes[0].imshow(
        report["reciprocity"].evidence.difference, origin="lower", extent=(0, 90, 0, 90), cmap="YlOrRd", vmin=0, vmax=1
    )
    axes[0].set_title(f"kd = {model.kd:g}, ks = {model.ks:g}, p = {model.p:g}", fontsize=11)
    axes[0].set_xlabel("angle of wi, degrees", fontsize=11)
    axes[0].set_ylabel("angle of wo, degrees", fontsize=11)
    figure.colorbar(image).set_label("relative difference of f", fontsize=11)
    save(figure, "reciprocity")
    return verdict(report, "reciprocity")


def edge() -> list[str]:
    theta = np.linspace(-60.0, 100.0, 1601)
    figure, axes = canvas(2)
    rows = []
    for p, color in zip((0.5, 1.0, 4.0, 32.0), COLORS, strict=True):
        model = go.Phong(kd=0.0, ks=0.5, p=p)
        value = slice_of(model, -70.0, theta)
        axes[0].plot(theta, value, color=color, label=f"p = {p:g}")
        zoom = slice_of(model, -20.0, np.linspace(-75.0, -60.0, 400))
        # here the curves of the two largest p are 0 to within the line width and would hide each other
        axes[1].plot(np.linspace(-75.0, -60.0, 400), zoom, color=color, lw=3.5 if p == 4.0 else 1.5)
        rows.append(f"| {p:g} | {float(slice_of(model, -70.0, np.array([89.99]))[0]) / 0.5:.3f} |")
    axes[0].axvline(90.0, color="#888", lw=0.8, ls=":")
    axes[0].set_title("viewer at 70°: the highlight ends at the horizon", fontsize=11, loc="left")
    axes[1].set_title("viewer at 20°: the edge where v.r = 0", fontsize=11, loc="left")
    for axis in axes:
        axis.set_xlabel("angle of the light, degrees", fontsize=11)
    axes[0].set_ylabel("reflected, light of intensity 1", fontsize=11)
    axes[0].legend(frameon=False, fontsize=10)
    save(figure, "edge")
    return rows


def main() -> int:
    """Write the page and its pictures."""
    PICTURES.mkdir(exist_ok=True)
    power, under, mirrored = even_power(), below(), reciprocity()
    _, rows = energy()
    edges = edge()
    text = f"""# Limits of the Phong model

Phong1975 describes a highlight that looks plausible, but the model is not derived from physics. The
[lab sheet](course/lab2-phong.md) of the course asks when the model gives wrong results. This page shows each failure,
with the verdict of `gonio verify`. It is generated by `python docs/make_phong_limits.py`; every number is measured.

    gonio verify phong                          # the laws that the model violates, with the declared violations
    gonio verify phong --param kd=0 --param ks=1 --vary p=1..64

## 1. v.r < 0, raised to an even power
On this page, n is the normal, l is the direction toward the light, v is the direction toward the viewer, and r is l
reflected about n. The specular term is ks (v.r)^p. If the viewer is more than 90 degrees away from r, v.r is negative,
and an even power makes it positive: a spurious second highlight appears on the opposite side.

![Reflected light as a function of the light angle: a second highlight without max(0, ...)](phong-limits/even-power.svg)

The sampler generates directions around the mirror direction of the viewer and never samples the spurious highlight.
The verifier therefore finds positive values of `eval` where the pdf is 0. {power}

Remedy: use max(0, v.r), and never raise a number of unknown sign to a power.

## 2. Light from below the surface
If the light is below the surface, n.l is negative, and the diffuse term subtracts light. The highlight also shines
through the surface: r then points below the surface as well, but may still be close to the direction of a viewer near
the horizon.

![Reflected light as a function of the light angle, with and without a test of n.l](phong-limits/below.svg)

{under}

## 3. More light is reflected than is incident
The terms are not normalized. At normal incidence, int (v.r)^p dwi = 2 pi / (p + 1), which exceeds 1 for p < 5.28 if
ks = 1; the diffuse term alone gives pi if kd = 1. Relative to the incident power, the error is larger. The power that a
beam delivers to the surface is proportional to cos theta, but the specular term lacks the factor n.l: a beam at grazing
incidence is reflected as brightly as one at normal incidence. The ratio of reflected to incident power therefore grows
as 1 / cos theta for any p.

![Radiance toward the viewer, and reflected power / incident power, for four exponents p](phong-limits/energy.svg)

| p (kd = 0, ks = 1) | largest int eval dwi | power ratio, light at 0 degrees | at 87 degrees | energy | reciprocity |
|---|---|---|---|---|---|
{chr(10).join(rows)}

If the specular term is multiplied by (p + 2) / (2 pi) and by n.l (Lafortune1994), no albedo exceeds 1.

## 4. The BRDF is not reciprocal
The BRDF is f = `eval` / cos theta_i = kd + ks (v.r)^p / (n.l). If light and viewer are exchanged, v.r is unchanged,
but n.l is not.

![Relative change of f if light and viewer are exchanged, as a function of both angles](phong-limits/reciprocity.svg)

{mirrored}. Paths traced from the camera and paths traced from the light therefore give different pictures.

## 5. Small exponents cause hard edges
A wide highlight does not fade out before the light reaches the horizon. If the viewer is at 70 degrees, the specular
term for light at the horizon is still a large fraction of its peak (see the table); for light below the horizon,
it is 0. The terminator is therefore a hard line. In addition, for p <= 1, the slope of (v.r)^p is discontinuous where
v.r passes through 0, which causes a visible edge in the middle of the lit side.

![The highlight that ends at the horizon, and the edge where v.r = 0, for four exponents p](phong-limits/edge.svg)

| p | specular term / its peak, for light at the horizon and a viewer at 70 degrees |
|---|---|
{chr(10).join(edges)}

`go.BlinnPhong` has no edge of the second kind, because n.h is never negative, but it has all the other failures.
`go.Conductor` has none of the five.
"""
    (HERE / "phong-limits.md").write_text(text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
