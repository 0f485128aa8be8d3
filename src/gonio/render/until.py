"""Rendering until the error is small enough.

The samples are two halves, each a picture by a sequence of random numbers of its own. What sets one apart from the
other is their noise, however even the points within each are: the variance of their mean is, without bias, a quarter of
their squared difference. That of one pixel tells little, and those of thousands together the error of the picture.

Where noise is uneven, the first samples decide how many of those to come the tiles of 4 x 4 pixels get. These shares
stay as they are from then on, and the samples that chose them are averaged with the rest by a weight that is the same
for all pixels: a pixel whose number of samples followed its own values would be biased.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .integrators import Render, Settings
from .integrators.progressive import SHARE, TILE, tiles
from .types import Scene

Picture = NDArray[np.float32]
Share = NDArray[np.uint32]

FIRST = 16  # samples per pixel, both halves together, before the first look at the error
FLOOR = 0.01  # relMSE = mean((x - r)^2 / (r^2 + FLOOR mean(r)^2)): a dim scene does not hide its noise
# The error falls with a power of the samples, 1 to 1.5: by the larger one no look comes much too late.
POWER = 1.5
LEAST_STEP, MOST_STEP = 1.04, 2.5  # factors of samples from one look to the next
LOW, HIGH = SHARE // 4, SHARE * 8  # what a tile gets at least and at most: the first samples miss rare light
PAYS, PAYS_SAMPLES = 0.8, 1 << 24  # shares must leave at most that part of the samples, and save so many: some seconds
AROUND = 3 * TILE  # pixels: a tile's noise is that of itself and of its neighbours, half and half


def squares(a: Picture, b: Picture) -> NDArray[np.float64]:
    """What each pixel adds to the relMSE of the mean of two pictures whose noise is independent: (height, width).

    A single bright sample in one of them would hide itself if the pixel's own mean stood for its true value, below the
    squared difference. So it stands for it only up to what its neighbours or both pictures agree on.
    """
    from scipy import ndimage  # here, since not every render loads SciPy

    a, b = a.astype(np.float64), b.astype(np.float64)
    mean = 0.5 * (a + b)
    agreed = np.maximum(ndimage.median_filter(mean, (3, 3, 1)), np.minimum(a, b))
    floor = FLOOR * np.mean(mean) ** 2
    true = np.minimum(mean, agreed) ** 2 + max(floor, 1e-30)
    found: NDArray[np.float64] = np.mean(0.25 * (a - b) ** 2 / true, axis=-1)
    return found


class Until:
    """A render until its relMSE is estimated to be `error` at most: `passes.run` takes it to its `goal`.

    most  samples per pixel, at most
    """

    def __init__(self, scene: Scene, settings: Settings, error: float, most: int, aovs: bool = False) -> None:
        self._scene, self._settings, self._aovs = scene, settings, aovs
        self.error, self._most = error, most
        # of the first samples, and of those that are shared out
        self._seeds = [int(seed) for seed in np.random.SeedSequence(settings.seed).generate_state(4)]
        self._halves = self._pair(self._seeds[:2], None)
        self._shares = not (settings.program.splats or settings.program.blurs)
        self._goal = FIRST
        self._before = 0  # samples that have chosen the shares
        self._pilot: tuple[Picture, Picture] | None = None  # what they have shown
        self._share: Share | None = None
        self._gain = 1.0  # samples that shares take to the same error, over those without

    def _pair(self, seeds: list[int], share: Share | None) -> tuple[Render, Render]:
        a, b = (Render(self._scene, replace(self._settings, seed=seed), aovs=self._aovs, share=share) for seed in seeds)
        return a, b

    # ------------------------------------------------------------------ as `passes.run` sees it

    @property
    def done(self) -> int:
        """Samples per pixel so far, on the mean of the pixels."""
        return self._before + sum(self._counts)

    @property
    def goal(self) -> int:
        """Samples per pixel at the next look at the error; where it is small enough, those that are done."""
        if self.done == self._goal:
            found = squares(*self._pictures())
            # where few pixels hold most of it, it is uncertain
            error = float(np.mean(found) + np.std(found) / math.sqrt(found.size))
            if error > self.error:
                self._go_on(error)
        return min(self._goal, self._most)

    def advance(self, count: int) -> None:
        """So many samples more, or those that one half still needs: the halves take turns."""
        needed = [
            most - n for most, n in zip(_halved(min(self._goal, self._most) - self._before), self._counts, strict=True)
        ]
        behind = 0 if needed[0] >= needed[1] else 1
        self._halves[behind].advance(min(count, needed[behind]))

    @property
    def _counts(self) -> tuple[int, int]:
        return self._halves[0].done, self._halves[1].done

    def image(self) -> Picture:
        a, b = self._pictures()
        first, second = (half + 0.5 * self._before for half in self._counts)
        return np.asarray((first * a + second * b) / max(first + second, 1.0), np.float32)

    def aov(self) -> dict[str, Picture]:
        a, b = (half.aov() for half in self._halves)
        first, second = self._counts
        return {name: np.asarray((first * a[name] + second * b[name]) / max(first + second, 1)) for name in a}

    @property
    def advice(self) -> str:
        found = self._halves[0].advice
        if self._settings.program.blurs:
            found = "; ".join(filter(None, [found, "the error is that of noise: the blur of caustics is not in it"]))
        return found

    def estimate(self) -> float:
        """The relMSE of the picture so far; inf where there is too little to tell."""
        if min(self._counts) == 0 and self._pilot is None:
            return math.inf
        return float(np.mean(squares(*self._pictures())))

    def _pictures(self) -> tuple[Picture, Picture]:
        a, b = (half.image() for half in self._halves)
        if self._pilot is None:
            return a, b
        olds = [self._gain * 0.5 * self._before / (self._gain * 0.5 * self._before + n) for n in self._counts]
        first, second = (old * x + (1.0 - old) * y for old, x, y in zip(olds, self._pilot, (a, b), strict=True))
        return first, second

    # ------------------------------------------------------------------ how far

    def _go_on(self, error: float) -> None:
        """Set the next goal, where the error is too large; after the first samples, share out the rest."""
        if self._shares and self._share is None and self.done == FIRST:
            self._share_out(error)
        # samples without shares that would be as good as those so far
        worth = self._before + (self.done - self._before) / self._gain
        factor = min(max((error / self.error) ** (1.0 / POWER), LEAST_STEP), MOST_STEP)
        more = (factor - 1.0) * worth * self._gain
        self._goal = self.done + 2 * max(math.ceil(0.5 * more), 1)

    def _share_out(self, error: float) -> None:
        a, b = self._pictures()
        share, gain = shares(squares(a, b))
        saved = (1.0 - gain) * self.done * (error / self.error - 1.0) * a.shape[0] * a.shape[1]
        if gain <= PAYS and saved >= PAYS_SAMPLES:
            self._take(share, gain, (a, b))

    def _take(self, share: Share, gain: float, pilot: tuple[Picture, Picture]) -> None:
        self._share, self._gain, self._pilot, self._before = share, gain, pilot, FIRST
        self._halves = self._pair(self._seeds[2:], share)

    # ------------------------------------------------------------------ checkpoints

    def state(self) -> dict[str, NDArray[Any]]:
        found: dict[str, NDArray[Any]] = {"goal": np.array([self._goal, *self._counts], np.int64)}
        if self._share is not None and self._pilot is not None:
            found |= {"share": self._share, "gain": np.array([self._gain])}
            found |= {f"pilot{i}": picture for i, picture in enumerate(self._pilot)}
        for i, half in enumerate(self._halves):
            found |= {f"half{i} {name}": values for name, values in half.state().items()}
        return found

    def restore(self, done: int, state: Mapping[str, NDArray[Any]]) -> None:
        """Go on to the same bits. Raises ValueError or KeyError for sums of another film."""
        if "share" in state:
            pilot = state["pilot0"], state["pilot1"]
            shape = self._halves[0].height, self._halves[0].width, 3
            if state["share"].shape != (shape[0] * shape[1],) or any(picture.shape != shape for picture in pilot):
                raise ValueError("shares of another film")
            self._take(state["share"], float(state["gain"][0]), pilot)
        self._goal, *counts = map(int, state["goal"])
        for i, (half, count) in enumerate(zip(self._halves, counts, strict=True)):
            head = f"half{i} "
            half.restore(count, {name.removeprefix(head): state[name] for name in state if name.startswith(head)})


def _halved(samples: int) -> tuple[int, int]:
    return (samples + 1) // 2, samples // 2


def shares(noise: NDArray[np.float64]) -> tuple[Share, float]:
    """How to share out samples, from each pixel's squared error: (share of each lane, samples that it takes to the same
    error, over those of equal shares).

    By the root of the noise the error is least (Neyman's allocation); tiles, as `Render` has them, keep together what
    is traced together.
    """
    from scipy import ndimage

    height, width = noise.shape
    order = tiles(width, height)
    smooth = 0.5 * (noise + np.maximum(ndimage.uniform_filter(noise, AROUND), 0.0))  # rounding goes below 0
    lane = smooth.ravel()[order]
    starts = np.arange(0, len(lane), TILE * TILE)
    sizes = np.diff([*starts, len(lane)])
    variance = np.add.reduceat(lane, starts) / sizes
    wanted = np.sqrt(variance)
    scale = 1.0
    for _ in range(20):  # until what is cut off above and below is made up for
        found = np.clip(np.rint(scale * SHARE * wanted / max(float(np.mean(wanted)), 1e-300)), LOW, HIGH)
        scale *= SHARE / float(np.average(found, weights=sizes))
    total = float(np.average(variance, weights=sizes))
    left = float(np.average(variance * SHARE / found, weights=sizes)) * float(np.average(found, weights=sizes)) / SHARE
    gain = left / total if total > 0.0 else 1.0
    return np.repeat(found.astype(np.uint32), sizes), gain
