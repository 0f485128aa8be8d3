"""Comparison of a student's picture of a scene with Gonio's, allowing for small shifts, gamma encoding and exposure.

The pictures are averaged over blocks, so that noise due to low sample counts has little effect. The most frequent ratio
of the two pictures is attributed to the exposure; objects with a different ratio are reported.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..errors import GonioError, InputError
from ..material import BSDF, models
from ..pictures import images
from ..pictures.exposures import RGB
from ..render import render
from ..scene import reader
from ..scene.schema import SceneDescription
from ..verify.forensics.ratio import NUMBERS, written
from .finding import RIGHT, WRONG, Finding, Mistake

Values = NDArray[np.float64]
BLOCKS = 48  # along the longer side
SPP = 64
SHIFTS = range(-2, 3)  # pixels
FITS = 0.04  # largest mean relative difference of the blocks: the noise of some 32 samples per pixel
UNLIKE = 0.6  # correlation below which a picture is considered to show another scene
CLEAN = 0.02  # relative accuracy to which a ratio is identified with a known number


class _Reading(NamedTuple):
    """An interpretation of a picture: its description, the mistake that it implies, if any, and the linear values."""

    words: str
    mistake: Mistake | None
    pixels: Values


class _Match(NamedTuple):
    reading: _Reading
    scale: float
    distance: float


def check(path: Path, scene: Path, allow_outside: bool = False, allow_code: bool = False) -> Finding:
    """Judge a picture of a scene. Raises InputError for a picture with a different aspect ratio or of another scene.

    allow_outside  allow the scene to read files outside its folder
    allow_code     allow the scene to run materials in Python files
    """
    picture = images.read(path)
    height, width = picture.pixels.shape[:2]
    outside = {"allow_outside": allow_outside, "allow_code": allow_code}
    film_width, film_height = _film(scene, outside)
    if width * film_height != height * film_width:
        what = f"the picture has {width} x {height} pixels, but the scene's film has {film_width} x {film_height}"
        raise InputError(what, path.name, "render the scene at its own size")
    if not np.all(np.isfinite(picture.pixels)):
        bad = int(np.sum(~np.isfinite(picture.pixels).all(axis=2)))
        raise InputError(f"{bad} pixels are NaN or infinite", path.name, "a division by 0 in a formula?")
    block = max(1, max(width, height) // BLOCKS)
    reference = _rendered(scene, (width, height), SPP, outside)
    expected = _blocks(reference, block)
    clipped = 1.0 if picture.hdr else None
    matches = sorted(
        (_match(one, expected, block, clipped) for one in _readings(path, picture)), key=lambda one: one.distance
    )
    best = next(one for one in matches if one.distance <= 1.1 * matches[0].distance + 1e-3)
    blocks = _blocks(best.reading.pixels, block)
    alike = np.corrcoef(np.log(blocks + 1e-3).ravel(), np.log(expected + 1e-3).ravel())[0, 1]
    if best.distance > 0.3 and not alike > UNLIKE:
        raise InputError(
            "this picture does not resemble the scene: it shows something else", path.name, "check --scene"
        )
    facts = [f"{best.distance:.1%} mean relative difference from Gonio's picture, by blocks of {block} pixels"]
    if best.reading.words:
        facts.append(best.reading.words if best.distance <= FITS else f"closest interpretation: {best.reading.words}")
    if abs(best.scale - 1.0) > CLEAN:
        facts.append(f"{written(best.scale, CLEAN)} times as bright, which is attributed to the exposure")
    figures = {"difference": best.distance, "scale": best.scale}
    if best.reading.mistake is not None and best.distance <= FITS:
        return Finding(path.name, "picture", WRONG, tuple(facts), best.reading.mistake, figures)
    if best.distance <= FITS:
        return Finding(path.name, "picture", RIGHT, tuple(facts), None, figures)
    objects = list(_objects(scene, (width // block, height // block), outside, blocks / best.scale, expected))
    facts += [words for words, _ in objects]
    mistake = next((one for _, one in objects if one is not None), None)
    return Finding(path.name, "picture", WRONG, tuple(facts), mistake, figures)


def _film(scene: Path, outside: dict[str, bool]) -> tuple[int, int]:
    """Width and height of the scene's film in pixels."""
    size = _read(scene, outside).camera.film.size
    return int(size[0]), int(size[1])


def _read(scene: Path, outside: dict[str, bool]) -> SceneDescription:
    return reader.read(scene, names_output=False, **outside)  # type: ignore[arg-type]


def _readings(path: Path, picture: images.Picture) -> Iterator[_Reading]:
    """The unchanged picture, and the picture with each of the usual mistakes undone."""
    given = np.asarray(picture.pixels, float)
    encodings = [("", given)]
    if not picture.hdr:
        raw = np.asarray(images.read(path, "linear").pixels, float)
        encodings += [("the file holds linear values: read without gamma", raw), ("read with gamma 2.2", raw**2.2)]
    turns = {
        "the picture is upside down": lambda p: p[::-1],
        "the picture is mirrored: left and right exchanged": lambda p: p[:, ::-1],
        "the picture is turned by 180 degrees": lambda p: p[::-1, ::-1],
        "red and blue are exchanged": lambda p: p[..., ::-1],
    }
    for words, pixels in encodings:
        for along_y, along_x in sorted(itertools.product(SHIFTS, SHIFTS), key=lambda s: abs(s[0]) + abs(s[1])):
            moved = f"shifted by {along_x} columns and {along_y} rows" if along_x or along_y else ""
            both = "; ".join(filter(None, (words, moved)))
            yield _Reading(both, None, np.roll(pixels, (-along_y, -along_x), (0, 1)))
        for words_of_turn, turn in turns.items():
            yield _Reading(words, Mistake(words_of_turn, "the order of rows, columns and channels"), turn(pixels))


def _match(reading: _Reading, reference: Values, block: int, clip: float | None) -> _Match:
    """The match of a reading: the most frequent exposure of the blocks, and the remaining mean relative difference."""
    given = _blocks(reading.pixels, block)
    lit = reference > 0.02 * np.percentile(reference, 99.0)
    lit &= given < 0.98 if clip is None else True  # a .png clips at white
    if not lit.any():
        return _Match(reading, 1.0, np.inf)
    ratio = given[lit] / reference[lit]
    scale = _mode(ratio)
    size = np.maximum(np.maximum(given, reference * scale), 1e-9)
    return _Match(reading, scale, float(np.mean((np.abs(given - reference * scale) / size)[lit])))


def _mode(ratio: Values) -> float:
    """The most frequent ratio, up to 2 %; 1 if a quarter of the ratios are about 1, or if no ratio is positive."""
    logs = np.sort(np.log(ratio[ratio > 0.0]))
    if not len(logs) or np.mean(np.abs(logs) < 0.02) > 0.25:
        return 1.0
    counts = np.searchsorted(logs, logs + 0.04) - np.arange(len(logs))
    first = int(np.argmax(counts))
    return float(np.exp(np.median(logs[first : first + int(counts[first])])))


def _blocks(pixels: Values | RGB, block: int) -> Values:
    """Means over blocks, (H / block, W / block, 3)."""
    height, width = (n // block for n in pixels.shape[:2])
    cut = np.asarray(pixels[: height * block, : width * block], float)
    return cut.reshape(height, block, width, block, 3).mean(axis=(1, 3))


def _rendered(
    scene: Path,
    size: tuple[int, int],
    spp: int,
    outside: dict[str, bool],
    overrides: dict[str, BSDF] | None = None,
) -> Values:
    """Gonio's picture, (H, W, 3), linear."""
    picture = render(scene, size=size, spp=spp, overrides=overrides, **outside)  # type: ignore[arg-type]
    return np.asarray(picture, np.float64)


def _objects(
    scene: Path, size: tuple[int, int], outside: dict[str, bool], given: Values, reference: Values
) -> Iterator[tuple[str, Mistake | None]]:
    """The difference on each object. The pixels of an object are those that become dark if it is rendered black."""
    shapes = _read(scene, outside).shapes
    for number, shape in enumerate(shapes):
        name = str(getattr(getattr(shape, "material", None), "type", ""))
        try:
            black = {f"shapes.{number}.material": models()["lambert"](albedo=0.0)}  # type: ignore[call-arg]
            dark = _rendered(scene, size, 16, outside, black)
        except GonioError:
            continue
        height, width = (min(a, b) for a, b in zip(dark.shape[:2], reference.shape[:2], strict=True))
        part = np.zeros(reference.shape[:2], bool)
        lit = reference[:height, :width].max(axis=2)
        part[:height, :width] = (dark[:height, :width].max(axis=2) < 0.2 * lit) & (lit > 0.0)
        if part.sum() < 4:
            continue
        ratio = np.median(given[part] / np.maximum(reference[part], 1e-9), axis=0)
        spread = np.percentile(given[part] / np.maximum(reference[part], 1e-9), [25, 75], axis=0)
        if np.all(np.abs(ratio - 1.0) < 2.0 * CLEAN) and np.all(np.ptp(spread, axis=0) < 0.1):
            continue
        which = f"object {number} ({name})" if name else f"object {number}"
        text = ", ".join(f"{r:.3g}" for r in ratio)
        words = f"{which}: {text} times as bright as it should be (red, green, blue)"
        yield words, _constant(which, ratio, spread)


def _constant(which: str, ratio: Values, spread: Values) -> Mistake | None:
    """The mistake of a constant factor; None if the ratio is not constant or not a known number."""
    if np.any(np.ptp(spread, axis=0) > 0.05 * ratio) or np.ptp(ratio) > CLEAN * ratio.max():
        return None
    text = written(float(ratio.mean()), CLEAN)
    if text not in NUMBERS:
        return None
    return Mistake(f"{which} is {text} times too bright: a factor that is missing or doubled", "a constant factor")
