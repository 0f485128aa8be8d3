"""Integrators: light transport over a Mitsuba scene, in passes that add up to the same picture to the bit.

    >>> render = Render(mi.load_dict(scene), Settings("path", max_depth=5))
    >>> while render.done < 256:
    ...     render.advance(16)          # stop here whenever you like: render.image() is the picture so far
    >>> picture = render.image()        # (height, width, 3) float32, row 0 on top

How it is fast:

- One lane holds one pixel, and one kernel walks through samples [first, first + count) of it, adding them up in
  registers. Memory does not grow with samples; first, count, seed, camera and every parameter of the scene are
  data of the kernel, so nothing is recompiled when they change.
- Lanes are pixels in 4 x 4 tiles: the vector unit's 16 rays stay together and hit the same things.
- A vertex costs one BSDF call, which evaluates the light's direction and samples the next; shadow rays that would
  carry nothing are not traced; the last ray of a path is traced only where it points at the light.
- Sampler and lights: see `sampler.py`, `lights.py`.
"""

from __future__ import annotations

from dataclasses import dataclass, make_dataclass
from functools import cache
from typing import Any

import drjit as dr
import numpy as np

from ..errors import InputError
from . import engine, sampler
from .lights import Lights

INTEGRATORS: dict[str, str] = {
    "path": "path tracing: light and BSDF sampling combined at every vertex (max_depth - 1 shaded vertices)",
    "direct": "direct light: light and BSDF sampling combined (multiple importance sampling)",
    "directSampleLight": "direct light, by sampling the lights only (mirrors and smooth glass are followed)",
    "directSampleBSDF": "direct light, by sampling the BSDF only",
    "whitted": "mirrors and smooth glass followed to depth 10, everything else lit by light sampling only",
    "normal": "the shading normal as a colour, (n + 1) / 2; black where nothing is hit",
    "uv": "the surface parameters as a colour, (u, v, 0)",
}
SAMPLERS: dict[str, str] = {
    "default": f"what measures best: {sampler.DEFAULT}, for every integrator",
    **sampler.SAMPLERS,
}

WHITTED_DEPTH = 10
# Russian roulette begins at this depth, as in Mitsuba's `path`: before it, paths are rarely dim enough to pay.
ROULETTE_DEPTH = 5

# Dimensions: each decision of a sample has a number of its own; a path's vertex takes VERTEX_DIMENSIONS of them.
PIXEL, TIME, APERTURE, FIRST_VERTEX = 0, 1, 2, 3
LIGHT, LOBE, CHOICE, ROULETTE, VERTEX_DIMENSIONS = 0, 1, 2, 3, 4

# The integral of the CIE 1931 luminosity curve as Mitsuba tabulates it (nm): white of radiance 1 has Y = 1.
CIE_Y_INTEGRAL = 106.7502593994140625

# 4 x 4 pixels fill the 16 lanes of AVX-512 and two packets of AVX2: on the five-conductor scene the same rays take
# 0.21 s in tiles and 0.32 s in scanlines.
TILE = 4

# Samples whose paths wait for each other, see Transport.accumulate.
BATCH = 16


@dataclass(frozen=True)
class Settings:
    """How to render.

    integrator  a name of `INTEGRATORS`
    max_depth   path: the longest path in segments, so N gives N - 1 shaded vertices; others ignore it
    sampler     a name of `SAMPLERS`
    seed        any integer of 32 bits; the same seed gives the same picture to the bit
    ambient     scene-wide ambient radiance (r, g, b): at every shaded vertex adds `ambient` times the BSDF's own
                attribute "ambient", where it has one (Phong's ka)
    """

    integrator: str = "path"
    max_depth: int = 5
    sampler: str = "default"
    seed: int = 0
    ambient: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        if self.integrator not in INTEGRATORS:
            raise InputError(
                f"unknown integrator '{self.integrator}'", "integrator", "one of " + ", ".join(INTEGRATORS)
            )
        if self.sampler not in SAMPLERS:
            raise InputError(f"unknown sampler '{self.sampler}'", "sampler", "one of " + ", ".join(SAMPLERS))
        if not 1 <= self.max_depth < 2**31:
            raise InputError(
                f"max_depth {self.max_depth}", "max_depth", "1 shows lights only, 2 direct light, and so on"
            )
        if not 0 <= self.seed < 2**32:
            raise InputError(f"seed {self.seed}", "seed", "a whole number from 0 to 4294967295")


class Render:
    """A picture in the making: call `advance` until there are enough samples, look at `image` at any time.

    scene     a loaded Mitsuba scene; its parameters may change between renders, not between passes
    sensor    the camera; None takes the scene's first. Its film gives the size; the pixel filter is a box
    aovs      also average albedo and normal of the first hit, for the denoiser
    """

    features = 0  # values that a subclass adds up beside the radiance

    def __init__(self, scene: Any, settings: Settings, sensor: Any = None, aovs: bool = False):
        self.mi = mi = engine.load()
        self.scene, self.settings, self.aovs = scene, settings, aovs
        if sensor is None and not scene.sensors():
            raise InputError("the scene has no camera", "scene.sensors()", "add a sensor, or pass one")
        self.sensor = sensor if sensor is not None else scene.sensors()[0]
        self.width, self.height = (int(n) for n in self.sensor.film().crop_size())
        self.done = 0
        self._order = _tiles(self.width, self.height)
        self._pixel = mi.UInt32(self._order)
        self._sums = _Sums.zeros(mi, self.width * self.height, 6 if aovs else self.features)
        dr.make_opaque(self._pixel, self._sums)  # zeros as data: else the first pass would be a kernel of its own
        # A camera that was just loaded and one that was moved hold the same numbers in another order, which would make
        # two kernels; this puts both in the second state.
        self.sensor.parameters_changed()
        with dr.suspend_grad():
            self._transport = self._program(mi)

    def _program(self, mi: Any) -> Transport:
        return Transport(mi, self.scene, self.sensor, self.settings, self.aovs)

    def advance(self, count: int) -> None:
        """Render `count` more samples of every pixel; returns when they are done.

        Sums are carried on in 64 bits in the order of the samples, which is why passes of any size add up to the
        same bits, and why a pass that is interrupted leaves the picture as it was before.
        """
        if count < 1:
            raise InputError(f"{count} samples asked for", "advance", "1 or more")
        mi = self.mi
        with dr.suspend_grad():
            first = dr.opaque(mi.UInt32, self.done)
            last = first + dr.opaque(mi.UInt32, count)
            key = sampler.pixel_key(self._pixel, dr.opaque(mi.UInt32, self.settings.seed))
            sums = self._transport.accumulate(self._pixel, key, first, last, self._sums)
            dr.eval(sums)
            dr.sync_thread()
        self._sums = sums
        self.done += count

    def image(self) -> np.ndarray:
        """The mean of the samples so far: (height, width, 3) float32, linear RGB, row 0 on top."""
        return self._mean(self._sums.near[0:3], self._sums.far)

    def aov(self) -> dict[str, np.ndarray]:
        """Features of the first hit for a denoiser, averaged over the same samples: {"albedo", "normal"}, (h, w, 3).

        Albedo is the mean of the BSDF's sampling weight, hence the fraction of light from all around that goes to
        the camera: a metal has its colour, a mirror and glass have about 1.
        """
        if not self.aovs:
            raise InputError("features were not rendered", "Render.aov", "make the Render with aovs=True")
        return {"albedo": self._mean(self._sums.near[3:6]), "normal": self._mean(self._sums.near[6:9])}

    @property
    def invalid(self) -> int:
        """How many values so far were not finite and were left out; anything but 0 is a fault of some BSDF or light."""
        return int(dr.sum(self._sums.invalid)[0])

    def _mean(self, *sums: list[Any]) -> np.ndarray:
        channels = [sum(np.asarray(part) for part in parts) for parts in zip(*sums, strict=True)]
        pixels = np.empty((self.height * self.width, len(channels)), np.float32)
        pixels[self._order] = np.stack(channels, axis=1) / max(self.done, 1)
        return pixels.reshape(self.height, self.width, len(channels))


def _tiles(width: int, height: int) -> np.ndarray:
    """The pixel (row * width + column) of each lane: tiles of TILE x TILE, row by row, without padding."""
    row, column = (grid.ravel() for grid in np.mgrid[0:height, 0:width])
    lane = np.lexsort((column % TILE, row % TILE, column // TILE, row // TILE))
    return (row * width + column)[lane].astype(np.uint32)


@dataclass
class _Sums:
    """What the lanes add up, in 64 bits: radiance and features of first vertices, radiance of the rest of the paths.

    A value that is not finite (a BSDF's overflow) is left out and counted, so that it does not cost the pixel.
    """

    near: list[Any]
    far: list[Any]
    invalid: Any

    @staticmethod
    def zeros(mi: Any, lanes: int, features: int) -> _Sums:
        near = [dr.zeros(mi.Float64, lanes) for _ in range(3 + features)]
        return _Sums(near, [dr.zeros(mi.Float64, lanes) for _ in range(3)], dr.zeros(mi.UInt32, lanes))

    def add_near(self, values: Any) -> _Sums:
        near, invalid = self._add(self.near, values, True)
        return _Sums(near, self.far, invalid)

    def add_far(self, values: Any, active: Any) -> _Sums:
        far, invalid = self._add(self.far, values, active)
        return _Sums(self.near, far, invalid)

    def _add(self, sums: list[Any], values: Any, active: Any) -> tuple[list[Any], Any]:
        finite = dr.isfinite(sum(values))
        add = [s + type(s)(dr.select(finite & active, v, 0)) for s, v in zip(sums, values, strict=True)]
        return add, self.invalid + dr.select(finite | ~dr.mask_t(finite)(active), type(self.invalid)(0), 1)


@dataclass
class _Path:
    """A path on its way, one a lane."""

    index: Any  # of the sample
    depth: Any  # segments traced so far
    ray: Any  # the next segment, and
    hit: Any  # what it meets
    throughput: Any
    eta: Any  # product of the relative indices on the way
    pdf: Any  # with which the BSDF chose this ray, 1/sr; 0 for camera rays and delta lobes
    solid_angle: Any  # LightSample.solid_angle at its origin
    radiance: Any  # found so far
    active: Any


@cache
def _waiting_type(variant: str) -> Any:
    """What is kept of a path that waits after its first vertex: `pack` and `unpack` of a _Path.

    A dataclass made for the variant, since Dr.Jit's local memory wants the true types of the fields. That memory
    cannot hold masks (in Dr.Jit 1.5 they do not compile for the CPU), so what an intersection found is kept
    without its mask `valid`; the distance says the same.
    """
    mi = engine.load()
    found = {name: kind for name, kind in mi.PreliminaryIntersection3f.DRJIT_STRUCT.items() if name != "valid"}
    kept = {"index": mi.UInt32, "ray": mi.Ray3f, "throughput": mi.Spectrum}
    kept |= dict.fromkeys(("eta", "pdf", "solid_angle"), mi.Float)

    def pack(path: _Path) -> Any:
        hit = {name: getattr(path.hit, name) for name in found}
        return waiting(**{name: getattr(path, name) for name in kept}, **hit)

    def unpack(rest: Any) -> _Path:
        hit = dr.zeros(mi.PreliminaryIntersection3f)
        for name in found:
            setattr(hit, name, getattr(rest, name))
        hit.valid = rest.t < dr.inf
        fields = {name: kind(getattr(rest, name)) for name, kind in kept.items()}
        return _Path(depth=mi.UInt32(1), hit=hit, radiance=mi.Spectrum(0), active=mi.Bool(True), **fields)

    waiting: Any = make_dataclass("Waiting", [*kept.items(), *found.items()])
    waiting.pack, waiting.unpack = staticmethod(pack), unpack
    return waiting


class Transport:
    """One integrator, bound to a scene: the program that the kernel runs for each lane."""

    def __init__(self, mi: Any, scene: Any, sensor: Any, settings: Settings, aovs: bool):
        self.mi, self.scene, self.sensor, self.settings, self.aovs = mi, scene, sensor, settings, aovs
        self.Waiting = _waiting_type(mi.variant())
        self.context = mi.BSDFContext()
        self.lights = Lights(mi, scene)
        self.pair = sampler.PAIRS[sampler.DEFAULT if settings.sampler == "default" else settings.sampler]
        size = sensor.film().crop_size()
        self.width = dr.opaque(mi.UInt32, int(size[0]))
        self.inverse_size = (dr.opaque(mi.Float, 1 / size[0]), dr.opaque(mi.Float, 1 / size[1]))
        depth = {"path": settings.max_depth, "whitted": WHITTED_DEPTH}.get(settings.integrator, 2)
        self.max_depth = dr.opaque(mi.UInt32, depth)
        self.ambient = self._ambient()
        name = settings.integrator
        self.samples_lights = name != "directSampleBSDF"
        self.samples_bsdf = name in ("path", "direct", "directSampleBSDF")  # smooth lobes too, not delta lobes alone
        self.follows_delta = any(mi.has_flag(shape.bsdf().flags(), mi.BSDFFlags.Delta) for shape in scene.shapes())
        # Whether any path has a second vertex to shade.
        self.goes_on = (name == "path" and settings.max_depth > 2) or (name == "whitted" and self.follows_delta)

    def _ambient(self) -> Any:
        """The ambient light as a texture of radiance, None where nothing would take it."""
        colour = self.settings.ambient
        if colour is None or not any(colour):
            return None
        if not any(dr.any(shape.bsdf().has_attribute("ambient")) for shape in self.scene.shapes()):
            return None
        # An rgb texture alone is a reflectance and ends at 1; d65 times one is a light, also in spectral variants.
        scale = max(colour)
        tint = {"type": "rgb", "value": [c / scale for c in colour]}
        return self.mi.load_dict({"type": "d65", "color": tint, "scale": scale})

    def accumulate(self, pixel: Any, key: Any, first: Any, last: Any, sums: _Sums) -> _Sums:
        """Add samples [first, last) of every pixel to the sums, each sum in the order of the samples.

        Samples go in batches of BATCH. The first vertices of a batch are done one sample after the other: their rays
        are coherent, every lane is busy. The paths that go on from there are put by, and then followed in a flat
        loop over vertices: a lane whose path has ended takes its next one at once, instead of idling until the
        longest of its 16 neighbours' has ended. What comes after the first vertex is summed apart, so that the
        order of additions, and hence the last bit, does not depend on where passes cut the batches.
        """
        mi = self.mi
        lanes = dr.width(pixel)
        # Counters of local memory start as full-width opaque arrays: Dr.Jit 1.5 takes a loop variable that starts as
        # one number to be the same in all lanes, and then writes every lane's entry at one lane's place.
        none = dr.opaque(mi.UInt32, 0, lanes)

        def batch(index: Any, sums: _Sums) -> tuple[Any, ...]:
            end = dr.minimum(index + BATCH, last)
            waiting = dr.alloc_local(self.Waiting, BATCH if self.goes_on else 1, value=dr.zeros(self.Waiting))

            def begin(index: Any, sums: _Sums, waiting: Any, count: Any) -> tuple[Any, ...]:
                path, values = self.begin(pixel, key, index)
                sums = sums.add_near(values)
                if self.goes_on:
                    waiting.write(self.Waiting.pack(path), count, path.active)
                    count = count + dr.select(path.active, mi.UInt32(1), mi.UInt32(0))
                return index + 1, sums, waiting, count

            state = (index, sums, waiting, none)
            state = dr.while_loop(state, lambda i, *_: i < end, begin, mode="symbolic", label="first vertices")
            index, sums, waiting, count = state
            if self.goes_on:
                sums = self.follow(key, waiting, count, none, sums)
            return index, sums

        start = first + dr.zeros(mi.UInt32, lanes)
        state = dr.while_loop((start, sums), lambda i, _: i < last, batch, mode="symbolic", label="batches")
        return state[1]

    def follow(self, key: Any, waiting: Any, count: Any, none: Any, sums: _Sums) -> _Sums:
        """Follow the paths put by in `waiting[0:count]` to their ends and add what they find."""
        mi = self.mi

        def body(slot: Any, path: Any, waiting: Any, sums: _Sums) -> tuple[Any, ...]:
            path = dr.select(path.active, path, waiting.read(slot).unpack())
            path = self.extend(path, key)
            ended = ~path.active
            sums = sums.add_far(self.rgb(path.radiance, path.ray.wavelengths), ended)
            return slot + dr.select(ended, mi.UInt32(1), mi.UInt32(0)), path, waiting, sums

        idle = dr.zeros(self.Waiting).unpack()
        idle.active = mi.Bool(False)
        state = (none, idle, waiting, sums)
        loop = dr.while_loop(state, lambda slot, *_: slot < count, body, mode="symbolic", label="further vertices")
        return loop[3]

    def begin(self, pixel: Any, key: Any, index: Any) -> tuple[_Path, list[Any]]:
        """The first vertex of a sample: (the path that goes on from it, [r, g, b, features of this vertex])."""
        path, features = self.first(pixel, key, index), list[Any]()
        if self.settings.integrator in ("normal", "uv"):
            return path, self.show(path.hit.compute_surface_interaction(path.ray))
        path = self.extend(path, key, features)
        return path, [*self.rgb(path.radiance, path.ray.wavelengths), *features]

    def first(self, pixel: Any, key: Any, index: Any) -> _Path:
        """A sample's path up to the first thing that it meets."""
        mi = self.mi
        ray, weight = self.camera_ray(pixel, key, index)
        ray = mi.Ray3f(ray)
        hit = self.scene.ray_intersect_preliminary(ray, coherent=True)
        return _Path(index, mi.UInt32(0), ray, hit, mi.Spectrum(weight), mi.Float(1), mi.Float(0),
                     mi.Float(0), mi.Spectrum(0), mi.Bool(True))  # fmt: skip

    def show(self, si: Any) -> list[Any]:
        """The pictures that need no light: `normal` and `uv`."""
        if self.settings.integrator == "normal":
            colour = (si.sh_frame.n + 1) * 0.5
        else:
            colour = self.mi.Color3f(si.uv.x, si.uv.y, 0)
        features = (0, 0, 0, *si.sh_frame.n) if self.aovs else ()
        return [dr.select(si.is_valid(), v, 0) for v in (*colour, *features)]

    def camera_ray(self, pixel: Any, key: Any, index: Any) -> tuple[Any, Any]:
        mi = self.mi
        row = pixel // self.width
        column = pixel - row * self.width
        x, y = self.pair(key, index, PIXEL)
        position = mi.Point2f((mi.Float(column) + x) * self.inverse_size[0], (mi.Float(row) + y) * self.inverse_size[1])
        wavelength, time = self.pair(key, index, TIME)
        aperture = mi.Point2f(0.5)
        if self.sensor.needs_aperture_sample():
            aperture = mi.Point2f(*self.pair(key, index, APERTURE))
        time = self.sensor.shutter_open() + time * self.sensor.shutter_open_time()
        return self.sensor.sample_ray(time, wavelength, position, aperture)

    def rgb(self, radiance: Any, wavelengths: Any) -> Any:
        mi = self.mi
        if mi.is_spectral:
            responses = [mi.cie1931_xyz(wavelength) * r for wavelength, r in zip(wavelengths, radiance, strict=True)]
            return mi.xyz_to_srgb(sum(responses) / (len(responses) * CIE_Y_INTEGRAL))
        if mi.is_monochromatic:
            return mi.Color3f(radiance[0])
        return radiance

    def extend(self, path: _Path, key: Any, features: list[Any] | None = None) -> _Path:
        """One vertex of a path: take its light, gather light there, choose the next direction and trace it.

        features  given at the first vertex: a list that gets its albedo and normal, if they are wanted
        """
        mi, lights = self.mi, self.lights
        first = features is not None
        ray, throughput, radiance, active = path.ray, path.throughput, path.radiance, path.active
        depth = mi.UInt32(0) if first else path.depth
        dimension = depth * VERTEX_DIMENSIONS + FIRST_VERTEX
        last = depth + 2 >= self.max_depth

        si = path.hit.compute_surface_interaction(ray, mi.RayFlags.All, active)
        emitted = lights.emitted(si, active)
        if self.samples_lights and not first:
            compete = active & (path.pdf > 0) & dr.any(emitted != 0)
            weight = mis(path.pdf, lights.pdf(ray.o, path.solid_angle, si, compete))
            emitted = dr.select(path.pdf > 0, emitted * weight, emitted)
        radiance = radiance + throughput * dr.select(active, emitted, 0)
        active = active & si.is_valid() & (depth + 1 < self.max_depth)

        bsdf = si.bsdf(ray)
        gathered, solid_angle, bs, weight = self.scatter(path.index, key, dimension, si, bsdf, active)
        radiance = radiance + throughput * dr.select(active, gathered, 0)
        if self.ambient is not None:
            radiance = radiance + throughput * self.ambient_light(bsdf, si, active)
        throughput = throughput * weight
        if features is not None and self.aovs:
            seen = (*self.rgb(throughput, ray.wavelengths), *si.sh_frame.n)
            features += [dr.select(active, v, 0) for v in seen]

        delta = mi.has_flag(bs.sampled_type, mi.BSDFFlags.Delta)
        active = active & dr.any(throughput != 0) & (self.samples_bsdf | delta)
        pdf = dr.select(delta, 0, bs.pdf) if self.samples_lights else mi.Float(0)
        eta = path.eta * dr.select(active, bs.eta, 1)
        if self.settings.integrator == "path":
            throughput, active = self.roulette(path.index, key, dimension, depth, throughput, eta, active)

        ray = si.spawn_ray(si.to_world(bs.wo))
        # The last ray can only find light: no surface beyond it is shaded.
        end = active & last

        def weigh(light: Any, light_pdf: Any) -> Any:
            return dr.select(pdf > 0, light * mis(pdf, light_pdf), light) if self.samples_lights else light

        radiance = radiance + throughput * dr.select(end, lights.last_hit(ray, solid_angle, end, weigh), 0)

        active = active & ~last
        hit = self.scene.ray_intersect_preliminary(ray, coherent=False, active=active)
        if not lights.has_environment:  # else the path goes on to meet it
            active = active & hit.is_valid()
        return _Path(path.index, depth + 1, ray, hit, throughput, eta, pdf, solid_angle, radiance, active)

    def scatter(self, index: Any, key: Any, dimension: Any, si: Any, bsdf: Any, active: Any) -> tuple[Any, ...]:
        """Ask the BSDF, in one call, what it does with a light's direction, and for a direction of its own.

        Returns (light gathered from the lights, solid angle of the light, BSDF sample, its weight).
        """
        mi, lights, context = self.mi, self.lights, self.context
        lobe, pick = self.pair(key, index, dimension + CHOICE)
        u = mi.Point2f(*self.pair(key, index, dimension + LOBE))
        if not self.samples_lights or lights.count == 0:
            return mi.Spectrum(0), mi.Float(0), *bsdf.sample(context, si, lobe, u, active)
        light = lights.sample(si, mi.Point2f(*self.pair(key, index, dimension + LIGHT)), pick, active)
        toward = si.to_local(light.ds.d)
        if self.samples_bsdf or self.follows_delta or self.aovs:
            value, pdf, bs, weight = bsdf.eval_pdf_sample(context, si, toward, lobe, u, active)
        else:
            value, pdf = bsdf.eval(context, si, toward, active), mi.Float(0)
            bs, weight = dr.zeros(mi.BSDFSample3f), mi.Spectrum(0)
        gathered = value * light.weight
        if self.samples_bsdf:
            gathered *= dr.select(light.delta, 1, mis(light.ds.pdf, pdf))
        visible = active & dr.any(gathered != 0)
        visible = self.unoccluded(si, light.ds.p, visible)
        return dr.select(visible, gathered, 0), light.solid_angle, bs, weight

    def unoccluded(self, si: Any, point: Any, active: Any) -> Any:
        """Lanes whose surface sees the point."""
        return active & ~self.scene.ray_test(si.spawn_ray_to(point), active)

    def ambient_light(self, bsdf: Any, si: Any, active: Any) -> Any:
        """Ambient radiance times the BSDF's attribute "ambient" (0 where it has none)."""
        if self.mi.is_rgb:
            reflected = bsdf.eval_attribute_3("ambient", si, active)
        else:
            reflected = bsdf.eval_attribute("ambient", si, active)
        return dr.select(active, reflected * self.ambient.eval(si, active), 0)

    def roulette(self, index: Any, key: Any, dimension: Any, depth: Any, throughput: Any, eta: Any, active: Any) -> Any:
        """End dim paths by chance: survive with the throughput's largest channel, at most 0.95, and weigh by it.

        Inside glass radiance is scaled by eta^2, which the way out takes back: it does not make a path important.
        """
        survive = dr.clip(dr.max(throughput) * dr.square(eta), 1e-6, 0.95)
        u, _ = sampler.independent_pair(key, index, dimension + ROULETTE)
        plays = depth + 1 >= ROULETTE_DEPTH
        active = active & (~plays | (u < survive))
        return dr.select(plays, throughput / survive, throughput), active


def mis(pdf: Any, other: Any) -> Any:
    """Power heuristic with exponent 2 for two strategies of one sample each (Veach 1995): p^2 / (p^2 + q^2)."""
    ratio = other / pdf  # first the ratio: p^2 itself overflows for sharp lobes
    return dr.select(pdf > 0, dr.rcp(dr.fma(ratio, ratio, 1)), 0)
