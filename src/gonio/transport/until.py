"""Render until the estimated error is small enough.

The samples are divided into two halves, each of which gives a picture from a separate random sequence. The two pictures
differ only by noise, even if the points within each half are stratified. A quarter of the squared difference is an
unbiased estimate of the variance of their mean. The estimate for a single pixel is uncertain, but its mean over
thousands of pixels gives the error of the picture.

If the noise varies over the picture, the first samples determine how many of the later samples each tile of 4 x 4
pixels gets. This distribution then remains fixed, and the first samples are averaged with the others by a weight that
is the same for all pixels. If the number of samples of a pixel depended on its own values, the pixel would be biased.

The blur of an integrator (`caustics`) is an additional error, which is the same in both halves. Each half also measures
the difference from a less blurred picture. The product of two such measurements is an unbiased estimate of the squared
difference, from which the error due to blur is computed. If the blur causes too large a part of the error, rendering
starts again with a smaller radius.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..bridge.types import Scene
from .integrators import Render, Settings
from .integrators.progressive import SHARE, TILE, tiles

Picture = NDArray[np.float32]
Share = NDArray[np.uint32]

FIRST = 16  # samples per pixel of both halves together before the first estimate of the error
FLOOR = 0.01  # relMSE = mean((x - r)^2 / (r^2 + FLOOR mean(r)^2)), so noise is relative to the scene's brightness
MARGIN = 0.5  # standard errors added to the estimate, because rendering ends at the first of several low estimates
# The error is proportional to a power of -1 to -1.5 of the number of samples. With the larger exponent, estimates are
# not made much too late.
POWER = 1.5
MIN_STEP, MAX_STEP = 1.04, 2.5  # limits of the ratio of the numbers of samples at consecutive estimates
LOW, HIGH = SHARE // 4, SHARE * 8  # limits of a tile's number of samples, because the first samples miss rare light
# Samples are distributed unevenly if this requires at most the first fraction of the samples and saves at least the
# second number of samples (some seconds).
MAX_GAIN, MIN_SAVED = 0.8, 1 << 24
# The ratio of a squared blur to its squared difference from a blur a quarter as wide. It is 1.14 for smooth light,
# where blur is proportional to the square of the radius, 1.31 for an edge within a pixel (power 3/2), and 1.90 for an
# edge across pixels (power 1/2); measured values are 0.8 to 1.3. The true value estimated below is more often too dark
# than too bright, so a lower ratio is used.
BLUR = 1.1
DARKEST = 0.4  # lower bound of the true value of a blurred pixel, as a fraction of the blurred value
BLUR_POWER = 1.5  # assumed exponent of the radius in the squared blur
# Fractions of the requested error: if blur exceeds the first, rendering starts again with the second as the target.
MAX_BLUR, BLUR_AIM = 0.5, 0.25
SURE = 3.0  # number of standard errors by which blur must exceed MAX_BLUR before rendering starts again
MIN_RADIUS = 1 / 64
WINDOW = 3 * TILE  # width in pixels of the window whose noise is averaged with that of a tile, in equal parts


def squares(a: Picture, b: Picture) -> NDArray[np.float64]:
    """Contribution of each pixel to the relMSE of the mean of two pictures with independent noise, (height, width)."""
    true, floor = _agreed(a, b)
    result: NDArray[np.float64] = np.mean(0.25 * (a.astype(np.float64) - b) ** 2 / (true**2 + floor), axis=-1)
    return result


def blur_error(a: Picture, b: Picture, blurs: Sequence[Picture]) -> Estimate:
    """The part of the relMSE of the mean of two pictures that blur causes.

    If light is blurred over a dark region, the true value is far less than the value in the pictures. It is estimated
    as the picture minus the difference, from the two estimates that are not in the product, so noise causes no bias.

    blurs  four estimates of the difference from a less blurred picture, two from `a` and two from `b`, all with
           independent noise
    """
    mean, floor = _agreed(a, b)
    d = [blur.astype(np.float64) for blur in blurs]

    def product(i: int, j: int) -> NDArray[np.float64]:
        p, q = {0, 1, 2, 3} - {i, j}
        true = np.clip(mean - 0.5 * (d[p] + d[q]), DARKEST * mean, mean)
        result: NDArray[np.float64] = BLUR * np.mean(d[i] * d[j] / (true**2 + floor), axis=-1)
        return result

    pairs = (product(0, 2), product(1, 3)), (product(0, 3), product(1, 2))
    variance = sum(float(np.sum((one - other) ** 2)) / 8.0 for one, other in pairs)
    return Estimate(float(np.mean(pairs)), math.sqrt(variance) / mean[..., 0].size)


def _agreed(a: Picture, b: Picture) -> tuple[NDArray[np.float64], float]:
    """An estimate of the true value of each pixel, and the floor of its square.

    If the mean of the two pictures were used, a single bright sample would reduce its own relative error. The mean is
    therefore limited to a value that is confirmed by the surrounding pixels or by both pictures.
    """
    from scipy import ndimage  # imported here, because most renders do not need SciPy

    mean = 0.5 * (a.astype(np.float64) + b)
    agreed = np.maximum(ndimage.median_filter(mean, (3, 3, 1)), np.minimum(a, b))
    return np.minimum(mean, agreed), max(FLOOR * float(np.mean(mean)) ** 2, 1e-30)


@dataclass(frozen=True)
class Estimate:
    """An estimated value and its standard deviation."""

    value: float
    deviation: float

    @staticmethod
    def mean(values: NDArray[np.float64]) -> Estimate:
        """The estimate of a mean from one value per pixel."""
        return Estimate(float(np.mean(values)), float(np.std(values)) / math.sqrt(values.size))

    def with_another(self, other: Estimate) -> Estimate:
        """The mean of this and another estimate, weighted by inverse variance."""
        a, b = (1.0 / max(one.deviation**2, 1e-300) for one in (self, other))
        return Estimate((a * self.value + b * other.value) / (a + b), (a + b) ** -0.5)


@dataclass(frozen=True)
class _Wide:
    """Two halves that were too blurred. Their picture is used as long as that of the new halves has a larger error.

    error   error of the picture
    blur    the part of the error due to blur
    width   `Until._width` of the halves
    radius  `Settings.radius` of the halves
    """

    halves: tuple[Render, Render]
    error: float
    blur: Estimate
    width: float
    radius: float


class Until:
    """A render that ends once its estimated relMSE is at most `error`; `passes.run` advances it to its `goal`.

    error  the relMSE to reach
    most   maximum number of samples per pixel
    aovs   whether to also average the albedo and the normal of the first hit, for the denoiser
    """

    def __init__(self, scene: Scene, settings: Settings, error: float, most: int, aovs: bool = False) -> None:
        self._scene, self._aovs = scene, aovs
        self._settings = replace(settings, measures=True) if settings.program.blurs else settings
        self.error, self._most = error, most
        # the seeds of the first samples and of the later samples, which may be distributed unevenly
        self._seeds = [int(seed) for seed in np.random.SeedSequence(settings.seed).generate_state(4)]
        self._shares = not (settings.program.splats or settings.program.blurs)
        self._goal = FIRST
        self._lost = 0  # number of samples of discarded pictures, which were too blurred
        self._narrowed = 0  # number of times that pictures were discarded
        self._halves = self._begun(settings.radius)
        self._wide: _Wide | None = None  # the last discarded halves
        self._before = 0  # number of samples that determined the distribution of the others
        self._pilot: tuple[Picture, Picture] | None = None  # the pictures from these samples
        self._share: Share | None = None
        self._gain = 1.0  # ratio of the samples needed with an uneven and an even distribution for the same error

    def _pair(self, seeds: list[int], share: Share | None) -> tuple[Render, Render]:
        a, b = (Render(self._scene, replace(self._settings, seed=seed), aovs=self._aovs, share=share) for seed in seeds)
        return a, b

    # ------------------------------------------------------------------ the interface of `passes.run`

    @property
    def done(self) -> int:
        """The number of samples per pixel so far, averaged over the pixels."""
        return self._lost + self._before + sum(self._counts)

    @property
    def goal(self) -> int:
        """The number of samples per pixel at the next estimate, or the current number if the error is small enough."""
        if self.done == self._goal:
            noise, blur = self._errors()
            # The estimate is uncertain if most of the error is in a few pixels.
            error = noise.value + blur.value + MARGIN * math.hypot(noise.deviation, blur.deviation)
            if error > self.error:
                self._go_on(error, noise, blur)
        return min(self._goal, self._most)

    def advance(self, count: int) -> None:
        """Render `count` samples, or the remaining samples of one half if these are fewer; the halves alternate."""
        each = _halved(min(self._goal, self._most) - self._lost - self._before)
        needed = [most - n for most, n in zip(each, self._counts, strict=True)]
        behind = 0 if needed[0] >= needed[1] else 1
        self._halves[behind].advance(min(count, needed[behind]))

    @property
    def _counts(self) -> tuple[int, int]:
        return self._halves[0].done, self._halves[1].done

    def image(self) -> Picture:
        if (wide := self._shown()) is not None:
            a, b = (half.image() for half in wide)
            first, second = (float(half.done) for half in wide)
        else:
            a, b = self._pictures()
            first, second = (half + 0.5 * self._before for half in self._counts)
        return np.asarray((first * a + second * b) / max(first + second, 1.0), np.float32)

    def _shown(self) -> tuple[Render, Render] | None:
        """The discarded halves if their error is smaller than that of the current halves, else None."""
        return self._wide.halves if self._wide is not None and self.estimate() == self._wide.error else None

    def aov(self) -> dict[str, Picture]:
        halves = self._shown() or self._halves
        a, b = (half.aov() for half in halves)
        first, second = (half.done for half in halves)
        return {name: np.asarray((first * a[name] + second * b[name]) / max(first + second, 1)) for name in a}

    @property
    def advice(self) -> str:
        return self._halves[0].advice

    @property
    def radius(self) -> float:
        """`Settings.radius` of the current halves."""
        return self._settings.radius

    def estimate(self) -> float:
        """The estimated relMSE of the current picture; inf if there are too few samples for an estimate."""
        least = math.inf if self._wide is None else self._wide.error
        if min(self._counts) == 0 and self._pilot is None:
            return least
        noise, blur = self._errors()
        return min(noise.value + blur.value, least)

    def _errors(self) -> tuple[Estimate, Estimate]:
        """The errors due to noise and due to blur."""
        a, b = self._pictures()
        noise = Estimate.mean(squares(a, b))
        if not self._settings.measures:
            return noise, Estimate(0.0, 0.0)
        blurs = [one for half in self._halves for one in half.differences()]
        if not blurs:
            return noise, Estimate(0.0, 0.0)
        blur = blur_error(a, b, blurs)
        if self._wide is not None:  # at a small radius, noise dominates the measured blur; use the earlier estimate too
            expected = self._wide.blur.value * (self._width() / self._wide.width) ** BLUR_POWER
            blur = blur.with_another(Estimate(expected, expected))
        return noise, Estimate(max(blur.value, 0.0), blur.deviation)

    def _width(self) -> float:
        """A number that is proportional to the mean radius of the maps so far."""
        return self._settings.radius * float(sum(self._counts)) ** self._settings.program.shrinking

    def _pictures(self) -> tuple[Picture, Picture]:
        a, b = (half.image() for half in self._halves)
        if self._pilot is None:
            return a, b
        olds = [self._gain * 0.5 * self._before / (self._gain * 0.5 * self._before + n) for n in self._counts]
        first, second = (old * x + (1.0 - old) * y for old, x, y in zip(olds, self._pilot, (a, b), strict=True))
        return first, second

    # ------------------------------------------------------------------ goals

    def _go_on(self, error: float, noise: Estimate, blur: Estimate) -> None:
        """Set the next goal if the error is too large; after the first samples, distribute the remaining samples."""
        # the factor by which the radius will shrink until the noise is small enough
        later = max(noise.value / ((1.0 - BLUR_AIM) * self.error), 1.0)
        later **= self._settings.program.shrinking
        sure = (blur.value - SURE * blur.deviation) * later**BLUR_POWER
        if sure > MAX_BLUR * self.error and self._settings.radius > MIN_RADIUS:
            factor = (BLUR_AIM * self.error / blur.value) ** (1.0 / BLUR_POWER) / later
            wide = _Wide(self._halves, noise.value + blur.value, blur, self._width(), self._settings.radius)
            self._lost, self._goal = self.done, self.done + FIRST
            self._narrow(max(self._settings.radius * factor, MIN_RADIUS), wide)
            return
        if self._shares and self._share is None and self.done == FIRST:
            self._share_out(error)
        # the equivalent number of evenly distributed samples
        worth = self._before + (self.done - self._before) / self._gain
        factor = min(max((error / self.error) ** (1.0 / POWER), MIN_STEP), MAX_STEP)
        more = (factor - 1.0) * worth * self._gain
        self._goal = self.done + 2 * max(math.ceil(0.5 * more), 1)

    def _share_out(self, error: float) -> None:
        a, b = self._pictures()
        share, gain = shares(squares(a, b))
        saved = (1.0 - gain) * self.done * (error / self.error - 1.0) * a.shape[0] * a.shape[1]
        if gain <= MAX_GAIN and saved >= MIN_SAVED:
            self._take(share, gain, (a, b))

    def _take(self, share: Share, gain: float, pilot: tuple[Picture, Picture]) -> None:
        self._share, self._gain, self._pilot, self._before = share, gain, pilot, FIRST
        self._halves = self._pair(self._seeds[2:], share)

    def _narrow(self, radius: float, wide: _Wide) -> None:
        self._narrowed += 1
        self._wide, self._halves = wide, self._begun(radius)

    def _begun(self, radius: float) -> tuple[Render, Render]:
        """Start two halves with the given radius and different seeds."""
        self._settings = replace(self._settings, radius=radius)
        if self._narrowed == 0:
            return self._pair(self._seeds[:2], None)
        sequence = np.random.SeedSequence([self._settings.seed, self._narrowed])
        return self._pair([int(seed) for seed in sequence.generate_state(2)], None)

    # ------------------------------------------------------------------ checkpoints

    def state(self) -> dict[str, NDArray[Any]]:
        result: dict[str, NDArray[Any]] = {"goal": np.array([self._goal, *self._counts], np.int64)}
        if (wide := self._wide) is not None:
            counts = [half.done for half in wide.halves]
            known = [wide.error, wide.blur.value, wide.blur.deviation, wide.width, wide.radius]
            result["narrowed"] = np.array([*counts, self._lost, self._narrowed, self._settings.radius, *known])
            result |= _sums("wide", wide.halves)
        if self._share is not None and self._pilot is not None:
            result |= {"share": self._share, "gain": np.array([self._gain])}
            result |= {f"pilot{i}": picture for i, picture in enumerate(self._pilot)}
        return result | _sums("half", self._halves)

    def restore(self, done: int, state: Mapping[str, NDArray[Any]]) -> None:
        """Continue with bit-identical results.

        Raises ValueError, LookupError or ArithmeticError if the state is that of another film.
        """
        if "share" in state:
            pilot = state["pilot0"], state["pilot1"]
            shape = self._halves[0].height, self._halves[0].width, 3
            if state["share"].shape != (shape[0] * shape[1],) or any(picture.shape != shape for picture in pilot):
                raise ValueError("shares of another film")
            gain = float(state["gain"][0])
            if state["share"].dtype != np.uint32 or not 0.0 < gain <= 1.0:
                raise ValueError("no shares")
            self._take(state["share"], gain, pilot)
        if "narrowed" in state:
            *counts, self._lost, times = map(int, state["narrowed"][:4])
            radius, error, value, deviation, *known = map(float, state["narrowed"][4:])
            self._narrowed = times - 1
            halves = self._begun(known[1])
            _restore("wide", halves, counts, state)
            self._narrow(radius, _Wide(halves, error, Estimate(value, deviation), *known))
        self._goal, *counts = map(int, state["goal"])
        _restore("half", self._halves, counts, state)


def _sums(name: str, halves: tuple[Render, Render]) -> dict[str, NDArray[Any]]:
    return {f"{name}{i} {key}": values for i, half in enumerate(halves) for key, values in half.state().items()}


def _restore(name: str, halves: tuple[Render, Render], counts: list[int], state: Mapping[str, NDArray[Any]]) -> None:
    for i, (half, count) in enumerate(zip(halves, counts, strict=True)):
        head = f"{name}{i} "
        half.restore(count, {key.removeprefix(head): state[key] for key in state if key.startswith(head)})


def _halved(samples: int) -> tuple[int, int]:
    return (samples + 1) // 2, samples // 2


def shares(noise: NDArray[np.float64]) -> tuple[Share, float]:
    """Distribute samples according to the squared error of each pixel.

    Returns the relative number of samples per lane, and the number of samples divided by that of an even distribution
    with the same error. The error is minimal if the numbers are proportional to the square root of the noise (Neyman
    allocation). Samples are distributed to the tiles of `Render`, which keep coherent rays together.
    """
    from scipy import ndimage

    height, width = noise.shape
    order = tiles(width, height)
    smooth = 0.5 * (noise + np.maximum(ndimage.uniform_filter(noise, WINDOW), 0.0))  # rounding errors may be negative
    lane = smooth.ravel()[order]
    starts = np.arange(0, len(lane), TILE * TILE)
    sizes = np.diff([*starts, len(lane)])
    variance = np.add.reduceat(lane, starts) / sizes
    wanted = np.sqrt(variance)
    scale = 1.0
    for _ in range(20):  # until the mean is SHARE in spite of clipping
        result = np.clip(np.rint(scale * SHARE * wanted / max(float(np.mean(wanted)), 1e-300)), LOW, HIGH)
        scale *= SHARE / float(np.average(result, weights=sizes))
    total = float(np.average(variance, weights=sizes))
    left = (
        float(np.average(variance * SHARE / result, weights=sizes)) * float(np.average(result, weights=sizes)) / SHARE
    )
    gain = left / total if total > 0.0 else 1.0
    return np.repeat(result.astype(np.uint32), sizes), gain
