"""Progressive rendering: passes of samples are added to a film (`Sums`), from which the picture is computed.

Performance:

- Each lane renders one pixel: a kernel iterates over samples [first, first + count) and adds them up in registers.
  Memory does not grow with the number of samples. The numbers first and count, the seed, the camera and every parameter
  of the scene are kernel data, so nothing is recompiled when they change.
- Lanes are ordered by 4 x 4 tiles of pixels, so the 16 rays of a vector are coherent and mostly hit the same objects.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import drjit as dr
import numpy as np
from numpy.typing import NDArray

from ... import garbage
from ...bridge import engine
from ...bridge.faults.borrowed_memory import own
from ...bridge.faults.denormal_numbers import denormals_rounded
from ...bridge.faults.interrupted_recording import interruptible
from ...bridge.faults.merged_mesh_bbox import with_valid_bbox
from ...bridge.types import Float, Scene, Sensor, UInt
from ...errors import InputError
from .. import sampler
from ..scene_data import SceneData
from ..sums import Sums
from .base import Integrator, Settings

# A tile of 4 x 4 pixels fills the 16 lanes of AVX-512 or two packets of AVX2. In the five-conductor scene, tracing the
# same rays takes 0.21 s in tiles and 0.32 s in scanlines.
TILE = 4

LANES = "lanes"  # key of the number of samples per lane in a state

SHARE = 16  # the number of samples of a lane is given in sixteenths of the mean

# In the first pass, all lanes read the same zeros, because writing a zero for each lane of a large film takes as long
# as its first sample. There are several entries because Dr.Jit compiles a different kernel for arrays with one entry.
NOTHING = 16


class Render:
    """A progressive render: call `advance` until there are enough samples; `image` can be called at any time.

    scene     a loaded Mitsuba scene, whose parameters may change between renders, but not between passes
    settings  integrator, depth, sampler and seed
    sensor    the camera, whose film determines the size of the picture; None selects the first camera of the scene. The
              pixel filter is a box
    aovs      whether to also average the albedo and the normal of the first hit, for the denoiser
    share     relative number of samples per lane, with a mean of SHARE over the picture; None if it is the same for all
    """

    features = 0  # number of values that a subclass accumulates in addition to the radiance

    def __init__(
        self,
        scene: Scene,
        settings: Settings,
        sensor: Sensor | None = None,
        aovs: bool = False,
        share: NDArray[np.uint32] | None = None,
    ):
        self.mi = mi = engine.load()
        if mi.is_polarized or mi.variant().startswith("scalar"):
            what = "is polarized" if mi.is_polarized else "works on one ray at a time"
            hint = "load the scene with another variant, such as llvm_ad_rgb, or use Mitsuba's own path"
            raise InputError(f"variant {mi.variant()} {what}", "Render", hint)
        if sensor is None and not scene.sensors():
            raise InputError("the scene has no camera", "scene.sensors()", "add a sensor, or pass one")
        self.scene, self.settings, self.aovs = with_valid_bbox(mi, scene), settings, aovs
        self.sensor = sensor if sensor is not None else scene.sensors()[0]
        self.width, self.height = (int(n) for n in self.sensor.film().crop_size())
        self.done = 0
        self._lanes: UInt | None = None  # samples per lane, if some lanes are ahead of `done`
        self._share = None if share is None else own(mi.UInt32, share)
        self._order = tiles(self.width, self.height)
        self._pixel = own(mi.UInt32, self._order)
        self._splatted = self.width * self.height if settings.program.splats else 0
        # The arrays of a newly loaded camera and of a moved one are created in a different order, which would cause two
        # kernels; this call creates the order of a moved camera.
        self.sensor.parameters_changed()
        with dr.suspend_grad(), garbage.paused(), denormals_rounded():
            self._integrator = self._integrator_of()
        self._sums = self._nothing(NOTHING)

    def _nothing(self, lanes: int) -> Sums:
        """Empty sums."""
        features = 6 if self.aovs else self.features
        return Sums.zeros(self.mi, lanes, 3 + self._integrator.measured, features, self._splatted)

    def _integrator_of(self, data: Callable[..., SceneData] = SceneData) -> Integrator:
        """The integrator, with its scene data."""
        settings, program = self.settings, self.settings.program
        parts = self.mi, self.scene, self.sensor, settings.sampler, settings.ambient
        return program(data(*parts, mis_compensation=program.samples_lobes, aovs=self.aovs), settings)

    @property
    def advice(self) -> str:
        """Advice to the user about the choice of this integrator for this scene; "" if there is none."""
        with dr.suspend_grad():
            return self._integrator.advice()

    def advance(self, count: int) -> None:
        """Render `count` more samples of every pixel, and wait until they are finished.

        Samples are accumulated in double precision and in order, so passes of any size give bit-identical sums. If a
        pass is interrupted, the picture remains unchanged.
        """
        if count < 1:
            raise InputError(f"{count} samples requested", "advance", "give 1 or more")
        mi = self.mi
        # Otherwise Dr.Jit would record each loop a second time without invariant variables, which LLVM eliminates
        # anyway.
        unchanged = dr.scoped_set_flag(dr.JitFlag.OptimizeLoops, False)
        with dr.suspend_grad(), garbage.paused(), interruptible(), unchanged, denormals_rounded():
            key = sampler.pixel_key(self._pixel, dr.opaque(mi.UInt32, self.settings.seed))
            sums, begun = self._sums, self._begun
            lowest, highest = self.done, self.done + count
            lanes, until = self._lanes, dr.opaque(mi.UInt32, highest)
            if self._share is not None:
                lanes, until = self._shared(lowest) if lanes is None else lanes, self._shared(highest)
            if lanes is not None:  # some lanes are ahead of others
                until = dr.maximum(lanes, until)
                dr.eval(lanes, until)
                lowest, highest = int(dr.min(lanes)[0]), int(dr.max(until)[0])
            for start, end in self._integrator.stages(lowest, highest):
                first, last = dr.opaque(mi.UInt32, start), dr.opaque(mi.UInt32, end)
                if lanes is not None:
                    first, last = dr.clip(lanes, first, last), dr.minimum(until, last)
                lane = dr.arange(mi.UInt32, len(self._pixel)) * dr.opaque(mi.UInt32, begun)
                sums, begun = self._integrator.accumulate(self._pixel, key, first, last, sums.at(lane)), True
                dr.eval(sums)
            dr.sync_thread()
        self._sums = sums
        self.done += count
        self._lanes = None if self._share is None else until

    def _shared(self, done: int) -> UInt:
        """The number of samples per lane if their mean over the picture is `done`."""
        mi = self.mi
        return mi.UInt32(mi.UInt64(self._share) * dr.opaque(mi.UInt64, done) // SHARE)

    @property
    def _begun(self) -> bool:
        """Whether the sums have an entry for every lane."""
        return self.done > 0 or self._lanes is not None

    def state(self) -> dict[str, NDArray[Any]]:
        """The accumulated samples, as arrays with one entry per lane, which later passes do not change."""
        if not self._begun:
            return self._nothing(len(self._pixel)).arrays()
        ahead = {} if self._lanes is None else {LANES: np.asarray(self._lanes)}
        return {**self._sums.arrays(), **ahead}

    def restore(self, done: int, state: Mapping[str, NDArray[Any]]) -> None:
        """Continue from the accumulated samples of `done` samples per pixel, with bit-identical results.

        Raises ValueError if the state is that of another film.
        """
        lanes = state.get(LANES)
        if lanes is not None and (lanes.shape != (len(self._pixel),) or lanes.dtype != np.uint32):
            raise ValueError("samples of other lanes")
        self._sums = Sums.of_arrays(self.mi, state, len(self._pixel), like=self._sums)
        self.done, self._lanes = done, None
        if lanes is not None and np.any(lanes != done):
            self._lanes = own(self.mi.UInt32, lanes)

    def select(self, lanes: slice) -> None:
        """Restart with only the given lanes, for a caller that assembles the picture from parts."""
        self._pixel = own(self.mi.UInt32, self._order[lanes])
        self._sums = self._nothing(NOTHING)
        self.done, self._lanes = 0, None

    def image(self) -> NDArray[np.float32]:
        """The mean of all samples so far, (height, width, 3), float32, linear RGB, with row 0 on top."""
        picture = self._mean(self._sums.radiance[:3])
        if self._splatted and self._begun:
            scale = self._integrator.unit / max(self.done, 1)
            splats = [np.array(channel) * scale for channel in self._sums.splats]
            picture += np.stack(splats, -1).reshape(picture.shape).astype(np.float32)
        return picture

    def differences(self) -> list[NDArray[np.float32]]:
        """Estimates of the difference from a less blurred picture, (height, width, 3) each.

        They come from independent samples, and are unbiased but noisy. The list is empty for an integrator without
        blur.
        """
        return self._integrator.differences(self._mean(self._sums.radiance[3:]), self.done)

    def aov(self) -> dict[str, NDArray[np.float32]]:
        """The features of the first hit for a denoiser, "albedo" and "normal", (height, width, 3) each.

        They are averaged over the same samples as the picture. The albedo is the mean of the BSDF's sampling weight,
        that is, the fraction of uniform illumination that reaches the camera. For a metal, it is the color; for a
        mirror or glass, it is about 1.
        """
        if not self.aovs:
            raise InputError("features were not rendered", "Render.aov", "make the Render with aovs=True")
        return {"albedo": self._mean(self._sums.features[:3]), "normal": self._mean(self._sums.features[3:])}

    @property
    def invalid(self) -> int:
        """The number of values so far that were not finite and were skipped.

        If it is not 0, a BSDF or a light is defective.
        """
        return int(dr.sum(self._sums.invalid)[0])

    def _mean(self, channels: Sequence[Float]) -> NDArray[np.float32]:
        """The mean of each channel, as a picture, (height, width, channels)."""
        mi = self.mi
        shape = (self.height, self.width, len(channels))
        if not self._begun:
            return np.zeros(shape, np.float32)
        done = dr.opaque(mi.UInt32, self.done) if self._lanes is None else self._lanes
        done = mi.Float64(dr.maximum(done, 1))
        pixels = dr.empty(mi.Float, self.width * self.height * len(channels))
        with denormals_rounded():
            for number, total in enumerate(channels):
                dr.scatter(pixels, mi.Float(total / done), self._pixel * len(channels) + number)
            return np.array(pixels, np.float32).reshape(shape)


def tiles(width: int, height: int) -> NDArray[np.uint32]:
    """The pixel (row * width + column) of each lane: pixels are ordered by tiles of TILE x TILE, without padding."""
    pixels = np.arange(height * width, dtype=np.uint32).reshape(height, width)
    edge = width - width % TILE  # tiles beyond this column are narrower
    order = np.empty(height * width, np.uint32)
    at = 0
    for top in range(0, height, TILE):
        band = pixels[top : top + TILE]
        rows = len(band)
        order[at : at + rows * edge] = band[:, :edge].reshape(rows, -1, TILE).swapaxes(0, 1).ravel()
        order[at + rows * edge : at + rows * width] = band[:, edge:].ravel()
        at += rows * width
    return order
