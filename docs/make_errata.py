"""Write docs/errata.md: public threads that question a material, each answered with values that are computed here.

python docs/make_errata.py [--check]      --check writes nothing and fails if a value differs from that on the page
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import gonio as go
import numpy as np
from gonio import ops
from book.generated import written

PAGE = Path(__file__).parent / "errata.md"
HEAD = """# Questions from public threads

Each section of this page summarizes a question that was raised in a public thread about a material, a table or a pdf,
and answers it with values computed by Gonio. `python docs/make_errata.py` computes the numbers after **Computed**, and
a test compares them with this page. Values "as reported" are quoted from the thread. Threads for which nothing was
computed are not listed. The programs that the threads discuss were not run for this page; the
[engine report cards](report-cards/engines/README.md) contain tests of several of them. The
[report cards](report-cards/README.md) list the failures of Mitsuba's plugins, each with a program that needs only
Mitsuba.
"""
SEED = 1


def white(roughness: float, **parameters: object) -> go.Metal:
    """A metal with F = 1, from the perceptual roughness that shaders use."""
    return go.Metal(r0=1.0, edge=1.0, alpha=roughness * roughness, **parameters)


def furnace(material: go.BSDF, cosines: Sequence[float]) -> np.ndarray:
    """Directional albedo of the first channel at each cosine of the view angle."""
    return np.asarray(go.albedo(material, mu=list(cosines)).value)[..., 0]


def table(headings: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [headings, ["---"] * len(headings), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def three_turquin() -> str:
    stated = {(0.5, 0.5): (0.90, 1.00), (0.75, 0.5): (0.84, 1.00), (1.0, 0.5): (0.72, 0.94), (1.0, 1.0): (0.58, 0.89)}
    rows = []
    for (roughness, cosine), (before, after) in stated.items():
        base = white(roughness)
        single, turquin, kulla = (furnace(one, [cosine])[0] for one in (base, go.Turquin(base), go.KullaConty(base)))
        gain = f"{(before - single) / (1.0 - single):.0%}"
        rows.append(
            [
                *(f"{roughness:g}", f"{cosine:g}", f"{single:.3f}", f"{before:.2f}", gain, f"{after:.2f}"),
                *(f"{turquin:.3f}", f"{kulla:.3f}"),
            ]
        )
    headings = [
        *("roughness", "n.v", "single scattering", "before, as reported", "fraction of the loss recovered"),
        *("after, as reported", "`turquin`", "`kulla-conty`"),
    ]
    return f"""A compensation term that was attributed to Turquin recovered "less than half" of the light that single
scattering loses. It was replaced by the formula of Turquin's paper. **Computed** albedo in a white furnace at F = 1:

{table(headings, rows)}

The thread's values for single scattering are confirmed. The formula of the paper multiplies the lobe by 1 / E; with an
exact E, it therefore gives 1 everywhere. If the new term does the same with a tabulated E, the tabulated values are
too large by 6 % and 12 % in the last two rows. The [report card of three.js](report-cards/engines/three.md) confirms
that they are too large, and shows how to correct the table.
Try it: `gonio plot "turquin(base=metal)" --kind albedo`."""


def blended_metalness() -> str:
    baked = go.bake("ggx", lut=["dfg"], resolution=64)
    mu, roughness, dfg = (np.asarray(baked.arrays[name]) for name in ("mu", "roughness", "dfg"))
    rows = []
    for wanted in (0.5, 1.0):
        row, column = int(np.argmin(abs(roughness - wanted))), int(np.argmin(abs(mu - 0.5)))
        a, b = dfg[row, column]

        def lobe(f0: float, a: float = a, b: float = b) -> float:
            """Albedo of single scattering plus Fdez-Aguera's term for multiple scattering, in a white furnace."""
            single, lost, average = f0 * a + b, 1.0 - a - b, f0 + (1.0 - f0) / 21.0
            return single + single * average / (1.0 - lost * average) * lost

        together, apart = lobe(0.5 * 1.0 + 0.5 * 0.04), 0.5 * lobe(1.0) + 0.5 * lobe(0.04)
        single = 0.52 * a + b
        rows.append([f"{x:.3f}" for x in (roughness[row], mu[column], single, together, apart)])
    return f"""A material is half metal (F0 = 1) and half dielectric (F0 = 0.04). Should F0 be blended before the
compensation, or should the lobes of both halves be compensated before they are blended? Single scattering is linear in
F0, but the compensation is not. **Computed** albedo of the specular lobe, from Gonio's split-sum table:

{table(["roughness", "n.v", "single scattering", "F0 blended first", "lobes compensated first"], rows)}

If F0 is blended first, the difference between the last two columns is lost in a white furnace.

Try it: `gonio bake ggx --lut dfg -o tables`."""


def added_lobes() -> str:
    baked = go.bake("ggx", lut=["dfg"], resolution=64)
    mu, roughness, dfg = (np.asarray(baked.arrays[name]) for name in ("mu", "roughness", "dfg"))
    row = int(np.argmin(abs(roughness - 0.5)))
    rows = []
    for wanted in (0.1, 0.3, 0.9):
        column = int(np.argmin(abs(mu - wanted)))
        specular = 0.04 * dfg[row, column, 0] + dfg[row, column, 1]
        rows.append([f"{mu[column]:.3f}", f"{1.0 + specular:.3f}", f"{specular + (1.0 - specular):.3f}"])
    return f"""If a white diffuse lobe and a dielectric reflection of F0 = 0.04 are simply added, more light leaves
than arrives. **Computed** albedo at roughness {roughness[row]:.3f}:

{table(["n.v", "plain sum", "diffuse lobe scaled by 1 minus the specular albedo"], rows)}

The scaled sum conserves energy but is not reciprocal, because its scale factor depends only on the view direction.
`coat` and `openpbr` (without fuzz) are reciprocal; `coat` conserves energy, and `openpbr` does so approximately
([energy](energy.md), [OpenPBR](openpbr.md))."""


def split_sum() -> str:
    baked = go.bake("ggx", lut=["dfg"], resolution=64)
    worst = baked.manifest["error"]["dfg"]["max"]
    a, b = baked.arrays["dfg"][32, 32]
    return f"""How is a split-sum table computed? `gonio bake ggx --lut dfg --resolution 256 -o tables` writes the table
as .npz, .exr and .png files and states its error. **Computed** for 64 texels per axis: the largest error of an entry is
{worst:.1e}; in the middle (roughness and n.v 0.508), A = {a:.4f} and B = {b:.4f}. [Energy](energy.md) gives the errors
of tables that are computed by sampling."""


def bounded_normals() -> str:
    wo = np.array([[np.sin(1.3), 0.0, np.cos(1.3)]])
    count = 200
    theta = (np.arange(count) + 0.5) / count * np.pi / 2
    phi = (np.arange(2 * count) + 0.5) / count * np.pi
    t, p = np.meshgrid(theta, phi, indexing="ij")
    wi = np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], -1).reshape(-1, 3)
    solid_angle = np.sin(t).ravel() * (np.pi / count) * (np.pi / 2 / count)
    u = np.random.default_rng(SEED).random((100_000, 3))
    rows = []
    for sampling in ("visible", "bounded"):
        metal = go.Metal(r0=1.0, edge=1.0, alpha=0.8, sampling=sampling)
        integral = float(np.sum(np.asarray(metal.pdf(np.repeat(wo, len(wi), 0), wi)).ravel() * solid_angle))
        sample = metal.sample(np.repeat(wo, len(u), 0), u)
        weight = np.asarray(sample.weight)[:, 0]
        above = float(np.mean((np.asarray(sample.wi)[:, 2] > 0) & (weight > 0)))
        rows.append([f"`{sampling}`", f"{integral:.2f}", f"{above:.2f}", f"{weight.mean():.2f}", f"{weight.std():.2f}"])
    headings = [
        *("sampling", "integral of the pdf above the surface", "fraction of samples above the surface"),
        *("mean weight", "standard deviation of the weight"),
    ]
    return f"""What is the density of bounded visible normals (Eto2023)? It is D divided by the area of the sampled part
of the cap: `bounded_per_cosine` in `optics/ndf/ggx.py`. The pdf is correct only if its integral equals the fraction of
samples above the surface. **Computed** for GGX with alpha = 0.8, at a view angle of 1.3 rad:

{table(headings, rows)}

Both methods have the same mean weight, which is the albedo, but bounded sampling wastes fewer samples. Try it:
`gonio verify metal -p sampling=bounded --law pdf`."""


def film_in_transmission() -> str:
    wo = np.repeat(np.array([[np.sin(0.6), 0.0, np.cos(0.6)]]), 100_000, 0)
    u = np.random.default_rng(SEED).random((len(wo), 3))
    rows = []
    for thickness in (200.0, 400.0):
        film = go.FilmDielectric(eta=1.5, alpha=0.0, thickness=thickness, film_eta=2.0)
        sample = film.sample(wo, u)
        weight, up = np.asarray(sample.weight), np.asarray(sample.wi)[:, 2:] > 0
        reflected = np.mean(weight * up, axis=0)
        transmitted = np.mean(weight * ~up, axis=0) * 1.5**2  # power: in the glass, radiance is higher by eta^2
        show = [" ".join(f"{value:.2f}" for value in one) for one in (reflected, transmitted, reflected + transmitted)]
        rows.append([f"{thickness:g} nm", *show])
    return f"""A thin film must also color the transmitted light, because light that is not reflected is transmitted.
**Computed** for a film of index 2 on glass of index 1.5, at 0.6 rad, in red, green and blue:

{table(["film", "reflected", "transmitted", "sum"], rows)}

`film-dielectric` and `openpbr` apply the film to both lobes ([thin films](thin-film.md))."""


def reciprocal_coat() -> str:
    coat = go.Coat(base=go.Lambert(albedo=1.0))
    rng = np.random.default_rng(SEED)
    wo, wi = (_hemisphere(rng, 2000) for _ in range(2))
    there, back = (np.asarray(coat.f(*pair, precision="float64"))[:, 0] for pair in ((wo, wi), (wi, wo)))
    worst = float(np.max(abs(there - back) / np.maximum(there, 1e-9)))
    white_coat = furnace(coat, [0.1, 0.5, 1.0])
    return f"""Is a coat that conserves energy necessarily nonreciprocal? **Computed** for Gonio's `coat` over a white
Lambertian base: if the directions are swapped, f changes by at most {_below(worst)} of its value (2,000 pairs), and
the albedo in a white furnace is
{", ".join(f"{value:.3f}" for value in white_coat)} for n.v = 0.1, 0.5 and 1.
The coat has both properties, because its layer tables depend on both directions. Try it:
`gonio verify coat -p base=lambert --law reciprocity`."""


def _hemisphere(rng: np.random.Generator, count: int) -> np.ndarray:
    z, phi = rng.random(count) * 0.98 + 0.02, rng.random(count) * 2 * np.pi
    r = np.sqrt(1 - z * z)
    return np.stack([r * np.cos(phi), r * np.sin(phi), z], -1)


def _below(value: float) -> str:
    """An upper bound on a value that does not depend on rounding errors."""
    return next(f"{bound:g}" for bound in (1e-12, 1e-9, 1e-6, 1e-4, 1e-3, 1e-2, 1e-1, 1.0) if value <= bound)


class NeubeltSheen(go.BSDF):
    """Charlie's distribution (Estevez2017) with Neubelt's visibility, as in glTF's KHR_materials_sheen."""

    color: go.Colour = go.spectrum(1.0, doc="Color of the sheen.")
    alpha: go.Number = go.number(0.25, low=0.01, high=1.0, doc="Width of the lobe, the square of the roughness.")

    def eval(self, wo, wi, mode="radiance"):  # type: ignore[no-untyped-def]
        h = ops.normalize(wo + wi)
        sine = ops.sqrt(ops.maximum(1.0 - h.z * h.z, 0.0))
        d = (2.0 + 1.0 / self.alpha) * ops.pow(sine, 1.0 / self.alpha) / (2.0 * np.pi)
        value = d / (4.0 * (wi.z + wo.z - wi.z * wo.z)) * wi.z
        return self.color * ops.where((wo.z > 0) & (wi.z > 0), value, 0.0)


def sheen() -> str:
    cosines = (0.1, 0.5, 0.9)
    rows = []
    for roughness in (0.3, 0.6, 1.0):
        values = _quadrature(NeubeltSheen(alpha=roughness**2), cosines)
        rows.append([f"{roughness:g}", *(f"{value:.3f}" for value in values)])
    headings = ["roughness", *(f"n.v = {cosine:g}" for cosine in cosines)]
    return f"""A curve that was fitted to the albedo of sheen had an average error of 62 % and was refitted.
**Computed** albedo of white sheen, to which such a curve can be fitted (`NeubeltSheen` in `docs/make_errata.py`
implements the formula as a short material):

{table(headings, rows)}

For more values, run `gonio bake docs/make_errata.py:NeubeltSheen -p alpha=0.36 -o sheen`. Gonio's own `sheen-charlie`
uses the masking term of Estevez2017 instead."""


def _quadrature(material: go.BSDF, cosines: Sequence[float]) -> list[float]:
    """Albedo by a product quadrature rule, which is accurate for a smooth, broad lobe."""
    nodes, weights = np.polynomial.legendre.leggauss(200)
    z, phi = (nodes + 1) / 2, (np.arange(200) + 0.5) / 200 * 2 * np.pi
    zz, pp = np.meshgrid(z, phi, indexing="ij")
    r = np.sqrt(1 - zz**2)
    wi = np.stack([r * np.cos(pp), r * np.sin(pp), zz], -1).reshape(-1, 3)
    area = np.repeat(weights / 2, 200) * 2 * np.pi / 200
    values = []
    for cosine in cosines:
        wo = np.repeat([[np.sqrt(1 - cosine**2), 0.0, cosine]], len(wi), 0)
        values.append(float(np.sum(np.asarray(material.eval(wo, wi, precision="float64"))[:, 0] * area)))
    return values


THREADS: dict[str, tuple[str, Callable[[], str]]] = {
    "Rough metals are too dark": ("mrdoob/three.js#33983 mrdoob/three.js#32072", three_turquin),
    "Partly metallic materials": ("mrdoob/three.js#32190 bevyengine/bevy#23818", blended_metalness),
    "Adding diffuse and specular lobes": ("google/filament#10140", added_lobes),
    "The albedo of sheen": ("mrdoob/three.js#32397 mrdoob/three.js#32356", sheen),
    "Computing a split-sum table": ("lzhnb/GS-IR#19", split_sum),
    "The density of bounded visible normals": ("nvpro-samples/nvpro_core#74", bounded_normals),
    "Thin films and transmitted light": ("AcademySoftwareFoundation/MaterialX#3026", film_in_transmission),
    "Reciprocity and energy conservation": ("adobe/openpbr-bsdf#30", reciprocal_coat),
}


def section(title: str) -> str:
    """The Markdown section of a topic: its threads, and the answer."""
    threads, answer = THREADS[title]
    links = []
    for thread in threads.split():
        repository, _, number = thread.partition("#")
        links.append(f"[{thread}](https://github.com/{repository}/issues/{number})")
    return f"## {title}\n\n{', '.join(links)}\n\n{answer()}\n"


def main() -> int:
    """Write or check the page, and return the exit code."""
    text = "\n".join([HEAD, *map(section, THREADS)])
    return written(PAGE, text, "run this script")


if __name__ == "__main__":
    sys.exit(main())
