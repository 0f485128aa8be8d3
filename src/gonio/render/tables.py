"""Energy tables on disk: the folder that `gonio bake` writes and `gonio info` reads.

    tables.npz      all arrays, float64, and the manifest
    manifest.json   the manifest alone
    E.exr ...       float32 pictures of the tables, with row 0 (the lowest roughness) on top. The slices of a table with
                    three axes are stacked vertically, the first on top. The .png files are the same in linear 8 bits

With layout "homework", the folder contains E.png, E_avg.png and dfg.png exactly as in the homework
(`baked.homework_pictures`). The levels of an environment are level_0.exr, level_1.exr and so on.
"""

from __future__ import annotations

import inspect
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from .. import files
from ..arguments import renamed
from ..catalog import library, notation, operands, outside, texts
from ..catalog.material import MaterialLike, material
from ..catalog.operands import Kind
from ..energy.albedo.monte_carlo import Sampling
from ..energy.tables import bake as baking
from ..energy.tables import ltc, ltc_anisotropic, prefilter
from ..energy.tables.baked import Baked, homework_pictures, load
from ..errors import InputError, did_you_mean
from ..material import BSDF, is_model, model, models
from ..material.user_code import option
from ..optics.masking import Masking
from ..optics.ndf import NDF, distributions
from ..owner import public
from ..pictures import images
from ..shaders.area_light import area_light

BAKED = frozenset({Kind.DISTRIBUTION, Kind.PICTURE, *operands.MATERIALS})


@renamed(size="resolution", spp="samples", points="sampler")
@public
def bake(
    target: MaterialLike = "ggx",
    output: str | Path | None = None,
    *,
    preset: str | None = None,
    lut: Sequence[str] | None = None,
    resolution: int | None = None,
    method: str = "quadrature",
    masking: str | None = None,
    samples: int = 1024,
    sampler: str = "hammersley",
    seed: int | None = None,
    layout: str = "linear",
    aspect: float | None = None,
    azimuths: int = baking.AZIMUTHS,
    store: str = "E",
    flip: bool = True,
    floor: float = 0.0,
    wrap: bool = False,
    ndf: str | None = None,
    levels: int | None = None,
) -> Baked:
    """Bake tables of the directional and mean albedo, the split sum and rough glass, or prefilter an environment.

        go.bake("ggx", "tables").arrays["E"]            # [roughness, mu]
        go.bake("sky.hdr", "sky", ndf="beckmann")       # level_0, level_1 ... [theta, phi, rgb]

    target    the name of a distribution (with F = 1), a material, or a latitude-longitude environment map (.hdr, .exr,
              .npz), whose only table is "prefiltered"
    output    folder for the files, which are written completely or not at all; None writes no files
    lut       tables to bake: any of "E", "Eavg", "dfg" and "glass", or only "ltc", linearly transformed cosines with
              shader code for quadrilateral area lights. None bakes all that apply to the target, except "glass"
    resolution  texels per axis, 1 to 4096, by default 128; for "ltc", 2 to 256, by default 64, if anisotropic 16
    method    "quadrature", or the density to sample: "cosine", the name of the distribution, or "visible"
    samples   number of samples per texel, unless `method` is "quadrature"
    sampler   "hammersley", with the same points for every texel, or, with `seed`, "independent" or "stratified"
    masking   masking term of a distribution
    layout    "linear" or "stretched" axes, or "homework": also the homework's pictures of E, or of 1 - E by `store`
    flip      whether the bottom row of the homework's pictures has the lowest roughness
    wrap      whether values in these pictures are rounded down to bytes, with 256 wrapping around to 0
    aspect    alpha_y / alpha_x of a distribution, which adds an axis phi with `azimuths` entries
    floor     lower bound of the denominator of D, for method "cosine"
    preset    "homework-text" or "homework-figure", whose options in PRESETS replace `masking`, `method` and others
    ndf       for an environment map: the distribution with which it is prefiltered; None selects ggx
    levels    for an environment map: the number of levels, for roughness 0 to 1; None selects 6, fewer for a small map
    Tables of microfacets, except "ltc", are stored in the user's cache. Returns a `Baked`: `arrays` by name, and a
    `manifest`, which describes each table and states its error. Raises InputError, MachineError if the disk is full.
    """
    if preset is not None:
        return _preset(target, output, preset, 128 if resolution is None else resolution, seed, store, flip)
    folder = None if output is None else files.check_folder(output)
    ndf, masking = option(ndf, "--ndf", NDF.family), option(masking, "--masking", Masking.family)
    axes = {"resolution": resolution, "layout": layout, "aspect": aspect, "azimuths": azimuths}
    sampling = {"method": method, "samples": samples, "sampler": sampler, "seed": seed, "floor": floor}
    picture = {"store": store, "flip": flip, "wrap": wrap}
    if _is_picture(target, lut):
        _check_default({**axes, **sampling, **picture}, "an environment takes --ndf, --levels and --masking")
        return _prefiltered(Path(str(target)), folder, ndf, levels, masking)
    _check_default({"ndf": ndf, "levels": levels}, "it goes with a picture: gonio bake sky.hdr --lut prefiltered")
    return _of_material(_target(target), folder, lut, {"masking": masking, **axes, **sampling}, picture)


def _of_material(
    target: str | BSDF,
    folder: Path | None,
    lut: Sequence[str] | None,
    options: Mapping[str, Any],
    picture: Mapping[str, Any],
) -> Baked:
    """Bake the tables of a distribution or a material, and write them if a folder is given."""
    resolution = options["resolution"]
    if lut and "ltc" in lut:
        _check_ltc(lut, {**options, **picture, "resolution": None, "masking": None})
        return _cosines(target, folder, resolution, options["masking"])
    options = {**options, "resolution": 128 if resolution is None else resolution}
    if options["layout"] == "homework":
        return _homework(target, folder, lut, options, picture)
    return _written(_baked(target, lut, options), folder)


def _written(baked: Baked, folder: Path | None) -> Baked:
    if folder is not None:
        _write(baked, folder, _pictures(baked))
    return baked


def _baked(target: str | BSDF, lut: Sequence[str] | None, options: Mapping[str, Any]) -> Baked:
    """Bake the tables; `options` are arguments of `bake`."""
    names = {"resolution": "size", "samples": "spp", "sampler": "points"}  # in `energy`
    given = {names.get(name, name): value for name, value in options.items()} | {"seed": options["seed"] or 0}
    sampling = Sampling(**{name: given.pop(name) for name in Sampling._fields})
    return baking.cached(target, lut=tuple(lut) if lut else None, sampling=sampling, **given)


LANGUAGES = ("glsl", "wgsl", "hlsl")  # of the code that comes with linearly transformed cosines


def _check_ltc(lut: Sequence[str], options: dict[str, object]) -> None:
    """Raise InputError for tables and options that cannot be combined with linearly transformed cosines."""
    if len(lut) > 1:
        what = f"ltc with '{next(name for name in lut if name != 'ltc')}'"
        raise InputError(what, "--lut", "its axes differ: bake them into two folders")
    _check_default(options, "ltc has axes and a method of its own")


def _cosines(target: str | BSDF, folder: Path | None, resolution: int | None, masking: str | None) -> Baked:
    """Bake linearly transformed cosines, with shader code for quadrilateral area lights."""
    material: Any = target
    if isinstance(target, str):
        made: Any = model("conductor")
        material = made(ndf=target, masking=masking or "smith-correlated").lossless()
    elif masking is not None:
        raise InputError("masking given for a material", "--masking", "the parameters of the material define it")
    fit: Any = ltc if material.isotropic else ltc_anisotropic
    baked = fit.bake(material, fit.SIZE if resolution is None else resolution, schlick=isinstance(target, str))
    codes = [area_light(baked, language) for language in LANGUAGES]
    baked.manifest["textures"] = codes[0].manifest["textures"]
    if folder is not None:
        contents = {code.manifest["shader"]: code.text.encode() for code in codes}
        for texture in codes[0].manifest["textures"]:
            contents[texture["file"]] = codes[0].tables[texture["uniform"]].astype("<f4").tobytes()
        _write(baked, folder, contents)
    return baked


def _homework(
    target: str | BSDF,
    folder: Path | None,
    lut: Sequence[str] | None,
    options: Mapping[str, Any],
    picture: Mapping[str, Any],
) -> Baked:
    """Bake tables with linear axes, and write them and the homework's pictures of them if a folder is given."""
    if not isinstance(target, str) or options["aspect"] not in (None, 1.0):
        problem = "a material, or two widths, in the homework's layout"
        raise InputError(problem, "--layout", "give a distribution such as ggx, with one width")
    if "glass" in (lut or ()):
        hint = "give E, Eavg or dfg, or another layout"
        raise InputError("table 'glass' in the homework's layout, which has no picture of it", "--lut", hint)
    baked = _baked(target, lut or ("E", "Eavg"), {**options, "layout": "linear"})
    if folder is not None:
        _write(baked, folder, _homework_files(baked, **picture))
    return baked


# The homework's two versions of E: with the k of its text, without noise, and with that of its cosine-sampled picture
PRESETS: dict[str, dict[str, Any]] = {
    "homework-text": {"masking": "schlick-direct"},
    "homework-figure": {
        "masking": "schlick-ibl", "method": "cosine", "samples": 1024, "sampler": "stratified", "floor": 1e-4
    },
}  # fmt: skip


def _preset(
    target: MaterialLike, output: str | Path | None, preset: str, resolution: int, seed: int | None, store: str,
    flip: bool,
) -> Baked:  # fmt: skip
    """Bake E and E_avg as in the homework's text or as in its figures.

    In the figures, E_avg has no noise, and bytes above 255 wrap around.
    """
    if preset not in PRESETS:
        raise InputError(f"unknown preset '{preset}' of a table", "--preset", did_you_mean(preset, list(PRESETS)))
    if target != "ggx":
        raise InputError(f"preset '{preset}' for '{target}'", "--preset", "the homework's tables are those of ggx")
    folder = None if output is None else files.check_folder(output)
    options = PRESETS[preset]
    made = bake("ggx", lut=["E"], resolution=resolution, seed=seed, **options)
    average = bake("ggx", lut=["Eavg"], resolution=resolution, masking=options["masking"])
    manifest = {**made.manifest, "preset": preset}
    for key in ("dims", "tables", "error", "hash"):
        manifest[key] = {**made.manifest[key], **average.manifest[key]}
    both = Baked({**made.arrays, **average.arrays}, manifest)
    if folder is not None:
        _write(both, folder, _homework_files(both, store, flip, wrap=preset == "homework-figure"))
    return both


def _homework_files(baked: Baked, store: str, flip: bool, wrap: bool) -> dict[str, bytes]:
    """The homework's pictures by file name. Their layout is recorded in the manifest."""
    baked.manifest["pictures"] = {"store": store, "bottom row": "lowest" if flip else "highest", "x": "n.v"}
    pictures = homework_pictures(baked, store, flip, wrap)
    return {f"{name}.png": images.png_bytes(pixels) for name, pixels in pictures.items()}


def _check_default(options: dict[str, object], hint: str) -> None:
    """Raise InputError for options that were given but do not apply to the target."""
    for name, value in options.items():
        if value != inspect.signature(bake).parameters[name].default:
            raise InputError(f"--{name} {value} does not apply to this target", f"--{name}", hint)


def _is_picture(target: MaterialLike, lut: Sequence[str] | None) -> bool:
    """Whether the target is a picture of an environment. Raises InputError for tables that do not apply to it."""
    pictured = isinstance(target, str | Path) and operands.kind_of(target, BAKED, "TARGET") is Kind.PICTURE
    others = [name for name in lut or () if name != "prefiltered"]
    if pictured and others:
        raise InputError(f"table '{others[0]}' of a picture", "--lut", "for an environment: --lut prefiltered")
    if not pictured and lut and "prefiltered" in lut:
        what = f"'prefiltered' of '{target}', which is not a picture ({', '.join(images.SUFFIXES)})"
        raise InputError(what, "--lut", "give an environment: gonio bake sky.hdr --lut prefiltered")
    return pictured


def _prefiltered(picture: Path, folder: Path | None, ndf: str | None, levels: int | None, masking: str | None) -> Baked:
    """Prefilter an environment map, and write its levels as pictures if a folder is given."""
    source = images.read(picture)
    if not source.hdr:
        what = "an 8-bit picture, whose values are clipped at white"
        raise InputError(what, str(picture), "give linear radiance, .hdr or .exr")
    if levels is None:  # fewer for a small map
        levels = min(prefilter.LEVELS, max(len(source.pixels).bit_length() - 1, 2))
    baked = prefilter.bake(source.pixels, ndf or "ggx", levels, masking or "smith-correlated", str(picture))
    if folder is not None:
        contents = {}
        for (name, pixels), level in zip(baked.arrays.items(), baked.manifest["levels"], strict=True):
            facts = {"ndf": baked.manifest["ndf"], "roughness": level["roughness"], "alpha": level["alpha"]}
            contents[f"{name}.exr"] = images._bitmap_bytes(pixels.astype(np.float32), facts, "OpenEXR")
        _write(baked, folder, contents)
    return baked


def _write(baked: Baked, folder: Path, contents: dict[str, bytes]) -> None:
    """Write the pictures, tables.npz and manifest.json, either all or none of them."""
    baked.manifest["files"] = ["tables.npz", "manifest.json", *contents]
    contents["tables.npz"] = baked.npz()
    contents["manifest.json"] = (json.dumps(baked.manifest, indent=2) + "\n").encode()
    files.write_all(folder, contents)


def _target(target: MaterialLike) -> str | BSDF:
    """Interpret a target: returns the name of a distribution, or a material."""
    if not isinstance(target, str | Path):
        return material(target)
    target = str(target)
    kind, (name, settings) = operands.kind_of(target, BAKED, "TARGET"), notation.split(target)
    if kind is Kind.DISTRIBUTION:
        if settings:
            hint = "bake a material, such as conductor; alpha is an axis of the table"
            raise InputError(f"'{name}' is a distribution, which has no parameters", "--param", hint)
        return target
    if kind is Kind.CODE:
        return _own(target, name)
    if kind is Kind.NAME and not (
        is_model(name) or library.resembles(name) or name.startswith("{") or texts.summands(target)
    ):
        known = [*distributions(), *models()]
        raise InputError(f"unknown distribution or material '{name}'", "TARGET", did_you_mean(name, known))
    return notation.named(target)[0]


def _own(target: str, name: str) -> str | BSDF:
    """A material from a Python file, or the name of a distribution from such a file."""
    thing = outside.thing(name, where="TARGET")
    material = getattr(thing, "family", BSDF.family) is BSDF.family
    return notation.named(target)[0] if material else outside.member(name, None, "TARGET", NDF.family)


def _pictures(baked: Baked) -> dict[str, bytes]:
    """A picture of each table, in which mu increases to the right and roughness downward.

    The slices along a third axis are stacked vertically.
    """
    files = {}
    for name, dims in baked.manifest["dims"].items():
        value = baked.arrays[name]
        if not dims:
            continue  # one number
        if dims == ["roughness"]:  # repeated along mu, so that the picture has the coordinates of E
            size = len(value)
            value = np.broadcast_to(value[:, None], (size, size, *value.shape[1:]))
        channels = value.shape[max(len(dims), 2) :] if dims != ["mu"] else value.shape[1:]
        value = value.reshape(-1, baked.manifest["size"], *channels)
        pixels = np.zeros((*value.shape[:2], 3), np.float32)
        pixels[...] = value[..., None] if not channels else np.pad(value, ((0, 0), (0, 0), (0, 3 - channels[0])))
        files[f"{name}.exr"] = images._bitmap_bytes(pixels, {}, "OpenEXR")
        files[f"{name}.png"] = images.png_bytes(np.round(np.clip(pixels, 0.0, 1.0) * 255.0).astype(np.uint8))
    return files


def describe(path: str | Path) -> dict[str, Any]:
    """Describe a baked folder or tables.npz: its manifest, and the range of values of each table."""
    baked = load(path)
    ranges = {n: [float(a.min()), float(a.max())] for n, a in baked.arrays.items()}
    return {**baked.manifest, "range": ranges}
