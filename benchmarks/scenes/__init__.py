"""The scenes of `benchmarks/suite.py`, which differ in aspects that distinguish path tracers.

Each is a function that returns a Mitsuba dictionary without camera, film and sampler; `Scene.load` adds those. All are
generated here, including textures and environments, so that the suite needs no files.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from gonio.bridge.faults.merged_mesh_bbox import with_valid_bbox

Dict = dict[str, Any]


@dataclass(frozen=True)
class Scene:
    """A scene: its content `make(mi)`, the size of its picture, the samples per pixel of the comparison, its depth."""

    name: str
    what: str
    make: Callable[[Any], Dict]
    size: tuple[int, int]
    spp: int
    depth: int
    eye: tuple[float, float, float]
    at: tuple[float, float, float]
    fov: float
    caustic: bool  # whether it is lit through smooth glass or metal, by paths that a camera path cannot find

    def load(self, mi: Any, sampler: str = "independent", spp: int | None = None) -> Any:
        """The scene loaded by Mitsuba, with one of its samplers."""
        width, height = self.size
        film = {"type": "hdrfilm", "width": width, "height": height, "rfilter": {"type": "box"}}
        sensor = {
            "type": "perspective",
            "fov": self.fov,
            "fov_axis": "y",
            "to_world": mi.ScalarTransform4f().look_at(list(self.eye), list(self.at), [0, 1, 0]),
            "film": {**film, "pixel_format": "rgb", "component_format": "float32"},
            "sampler": {"type": sampler, "sample_count": spp or self.spp},
        }
        return with_valid_bbox(mi, mi.load_dict({"type": "scene", "sensor": sensor, **self.make(mi)}))


SCENES: dict[str, Scene] = {}


def scene(
    size: tuple[int, int] = (320, 200),
    spp: int = 64,
    depth: int = 6,
    eye: tuple[float, float, float] = (0, 1.2, 4.5),
    at: tuple[float, float, float] = (0, 0.1, 0),
    fov: float = 30,
    caustic: bool = False,
) -> Callable[[Callable[[Any], Dict]], Callable[[Any], Dict]]:
    """Declare a scene: its name is that of the function, its description the first line of the docstring."""

    def declare(make: Callable[[Any], Dict]) -> Callable[[Any], Dict]:
        name = make.__name__.replace("_", "-")
        what = (make.__doc__ or "").strip().splitlines()[0].rstrip(".")
        SCENES[name] = Scene(name, what, make, size, spp, depth, eye, at, fov, caustic)
        return make

    return declare


# ---------------------------------------------------------------------- parts


def rgb(*value: float) -> Dict:
    return {"type": "rgb", "value": list(value) if len(value) > 1 else value[0]}


def grey(albedo: float = 0.5) -> Dict:
    return {"type": "diffuse", "reflectance": rgb(albedo)}


def metal(alpha: float, name: str = "Au") -> Dict:
    return {"type": "roughconductor", "distribution": "ggx", "material": name, "alpha": alpha}


def ball(x: float, bsdf: Dict, radius: float = 0.5, y: float = 0.0, z: float = 0.0) -> Dict:
    return {"type": "sphere", "center": [x, y, z], "radius": radius, "bsdf": bsdf}


def floor(mi: Any, bsdf: Dict, y: float = -0.5, side: float = 6.0) -> Dict:
    placed = mi.ScalarTransform4f().translate([0, y, 0]).rotate([1, 0, 0], -90).scale(side)
    return {"type": "rectangle", "to_world": placed, "bsdf": bsdf}


def lamp(mi: Any, at: list[float], to: list[float], half: float, radiance: float) -> Dict:
    """A square lamp that faces a point."""
    up = [0, 0, 1] if abs(at[0] - to[0]) + abs(at[2] - to[2]) < 1e-6 else [0, 1, 0]
    placed = mi.ScalarTransform4f().look_at(at, to, up).scale(half)
    return {"type": "rectangle", "to_world": placed, "emitter": {"type": "area", "radiance": rgb(radiance)}}


def sky(sun: float, width: int = 512) -> np.ndarray:
    """An environment, (width / 2, width, 3): blue above, brown below, clouds from waves, and a sun 3 degrees wide."""
    v, u = np.mgrid[0 : width // 2, 0:width]
    theta, phi = (v + 0.5) / (width // 2) * np.pi, (u + 0.5) / width * 2 * np.pi
    up = np.cos(theta)
    waves = 0.5 + 0.25 * np.sin(3 * phi + 4 * theta) + 0.25 * np.sin(7 * phi - 5 * theta)
    above = np.stack([0.3 + 0.5 * waves, 0.5 + 0.4 * waves, 0.9 + 0.1 * waves], -1) * (0.4 + 0.6 * up[..., None])
    below = np.stack([0.25 + 0 * up, 0.2 + 0 * up, 0.15 + 0 * up], -1)
    pixels = np.where(up[..., None] > 0, above, below)
    toward = np.array([np.sin(0.7) * np.sin(2.2), np.cos(0.7), -np.sin(0.7) * np.cos(2.2)])
    direction = np.stack([np.sin(theta) * np.sin(phi), up, -np.sin(theta) * np.cos(phi)], -1)
    pixels[direction @ toward > np.cos(np.radians(1.5))] = [sun, 0.9 * sun, 0.8 * sun]
    return pixels.astype(np.float32)


def environment(mi: Any, pixels: np.ndarray) -> Dict:
    return {"type": "envmap", "bitmap": mi.Bitmap(pixels)}


# ---------------------------------------------------------------------- metals and lamps


@scene(size=(500, 150), eye=(0, 1, 4), at=(0, 0, 0), fov=22)
def five_metals(mi: Any) -> Dict:
    """Five metal balls of increasing roughness on a floor under a square lamp."""
    balls = {f"ball{i}": ball(i - 2, metal(a), 0.45) for i, a in enumerate((0.05, 0.25, 0.5, 0.75, 0.99))}
    return {"floor": floor(mi, grey(0.7), -0.45, 10), "light": lamp(mi, [2, 3, 6], [2, 0, 6], 2, 50), **balls}


@scene(size=(64, 64), spp=16)
def tiny(mi: Any) -> Dict:
    """A picture of 64 x 64 pixels, as rendered by the hundreds in fits and parameter studies."""
    return {"floor": floor(mi, grey()), "light": lamp(mi, [1, 3, 2], [0, 0, 0], 0.7, 20), "ball": ball(0, metal(0.3))}


@scene()
def near_lamps(mi: Any) -> Dict:
    """Rectangular lamps close above rough metal."""
    lamps = {f"lamp{i}": lamp(mi, [1.5 * i - 1.5, 0.3, -0.8], [1.5 * i - 1.5, -0.5, 0.2], 0.3, 8) for i in range(3)}
    return {"floor": floor(mi, metal(0.3, "Al")), "ball": ball(0.2, metal(0.15), 0.35, -0.15, 0.5), **lamps}


# ---------------------------------------------------------------------- environments


@scene()
def soft_environment(mi: Any) -> Dict:
    """Two metal balls and a blue one under a bright sky without a sun."""
    return {"env": environment(mi, sky(1.0)), **_three(mi)}


@scene()
def sun_environment(mi: Any) -> Dict:
    """The same under a sky with a sun ten thousand times as bright."""
    return {"env": environment(mi, sky(1e4)), **_three(mi)}


def _three(mi: Any) -> Dict:
    blue = {"type": "diffuse", "reflectance": rgb(0.1, 0.2, 0.6)}
    balls = {"a": ball(-1.1, metal(0.05)), "b": ball(0, metal(0.4)), "c": ball(1.1, blue)}
    return {"floor": floor(mi, grey()), **balls}


@scene()
def textured(mi: Any) -> Dict:
    """Textures of color and roughness, and a normal map, under a sky and a lamp."""
    y, x = np.mgrid[0:128, 0:128] / 128
    checks = ((np.floor(8 * x) + np.floor(8 * y)) % 2)[..., None]
    colours = (0.1 + 0.7 * checks * np.array([0.9, 0.5, 0.2])).astype(np.float32)
    widths = (0.1 + 0.4 * (0.5 + 0.5 * np.sin(20 * x)))[..., None].astype(np.float32)
    slopes = 0.3 * np.sin(2 * np.pi * 6 * x), 0.3 * np.sin(2 * np.pi * 6 * y)
    normals = np.stack([-slopes[0], -slopes[1], np.ones_like(x)], -1)
    normals = (0.5 + 0.5 * normals / np.linalg.norm(normals, axis=-1, keepdims=True)).astype(np.float32)

    def texture(values: np.ndarray) -> Dict:
        return {"type": "bitmap", "bitmap": mi.Bitmap(values), "raw": True}

    brushed = {"type": "roughconductor", "distribution": "ggx", "material": "Cu", "alpha": texture(widths)}
    bumpy = {"type": "normalmap", "normalmap": texture(normals), "bsdf": metal(0.2)}
    return {
        "env": environment(mi, sky(1.0)),
        "lamp": lamp(mi, [1, 3, 2], [0, 0, 0], 0.5, 15),
        "floor": floor(mi, {"type": "diffuse", "reflectance": texture(colours)}),
        "a": ball(-0.6, brushed),
        "b": ball(0.6, bumpy),
    }


# ---------------------------------------------------------------------- glass, a room, many shapes


@scene(depth=10)
def rough_glass(mi: Any) -> Dict:
    """Two balls of rough glass in front of a metal one, under a sky."""
    glass = {"type": "roughdielectric", "distribution": "ggx", "int_ior": 1.5}
    balls = {"a": ball(-0.6, {**glass, "alpha": 0.1}, z=0.5), "b": ball(0.6, {**glass, "alpha": 0.4}, z=0.5)}
    return {"env": environment(mi, sky(30.0)), "floor": floor(mi, grey()), "c": ball(0, metal(0.1), z=-0.8), **balls}


@scene(depth=8, eye=(0, 0.5, 3.4), at=(0, 0.4, 0), fov=40)
def room(mi: Any) -> Dict:
    """A room lit through a gap under its ceiling."""
    to, white = mi.ScalarTransform4f(), grey(0.75)

    def wall(place: Any) -> Dict:
        return {"type": "rectangle", "to_world": place, "bsdf": {"type": "twosided", "bsdf": white}}

    walls = {
        "floor": wall(to.translate([0, -0.5, 0]).rotate([1, 0, 0], -90).scale(1.5)),
        "back": wall(to.translate([0, 0.5, -1.5]).scale(1.5)),
        "left": wall(to.translate([-1.5, 0.5, 0]).rotate([0, 1, 0], 90).scale(1.5)),
        "right": wall(to.translate([1.5, 0.3, 0]).rotate([0, 1, 0], -90).scale([1.5, 0.8, 1])),
        "ceiling": wall(to.translate([0, 1.5, 0]).rotate([1, 0, 0], 90).scale(1.5)),
    }
    balls = {"a": ball(-0.5, metal(0.2), 0.4, -0.1), "b": ball(0.5, grey(0.6), 0.4, -0.1)}
    return {"light": lamp(mi, [2.6, 1.6, 0], [1.5, 1.2, 0], 0.6, 30), **walls, **balls}


@scene(spp=32, eye=(0, 4, 9), at=(0, 0, 0), fov=35)
def many(mi: Any) -> Dict:
    """Ten thousand balls, a hundred lamps."""
    rng, bsdfs = np.random.default_rng(1), [grey(0.6), metal(0.3), metal(0.1, "Cu")]
    found: Dict = {f"bsdf{i}": {**bsdf, "id": f"bsdf{i}"} for i, bsdf in enumerate(bsdfs)}
    found["floor"] = floor(mi, grey(), -0.5, 8)
    for i in range(10_000):
        x, z, y = *rng.uniform(-4, 4, 2), rng.uniform(-0.45, 1.0)
        found[f"ball{i}"] = ball(x, {"type": "ref", "id": f"bsdf{i % 3}"}, rng.uniform(0.01, 0.04), y, z)
    for i in range(100):
        x, z = rng.uniform(-4, 4, 2)
        found[f"lamp{i}"] = lamp(mi, [x, 2, z], [x, 0, z], 0.05, float(10 ** rng.uniform(1, 2.5)))
    return found


# ---------------------------------------------------------------------- caustics

GLASS = {"type": "dielectric", "int_ior": 1.5}


@scene(depth=10, caustic=True)
def glass_ball(mi: Any) -> Dict:
    """A glass ball that focuses the light of a small lamp."""
    return {"floor": floor(mi, grey()), "light": lamp(mi, [2, 3, 1], [0, 0, 0], 0.1, 500), "ball": ball(0, GLASS)}


@scene(depth=8, caustic=True, eye=(0, 3, 2.5), at=(0, -0.4, 0))
def metal_ring(mi: Any) -> Dict:
    """The nephroid caustic inside a metal ring."""
    ring = {
        "type": "cylinder",
        "p0": [0, -0.5, 0],
        "p1": [0, -0.2, 0],
        "radius": 0.8,
        "bsdf": {"type": "twosided", "bsdf": {"type": "conductor", "material": "Ag"}},
    }
    return {"floor": floor(mi, grey()), "light": lamp(mi, [8, 5, 0], [0, -0.5, 0], 0.2, 1500), "ring": ring}


@scene(depth=10, caustic=True, eye=(0, 3, 3), at=(0, -0.3, 0))
def pool(mi: Any) -> Dict:
    """Light on the ground of a pool with waves."""
    side = 96
    y, x = np.mgrid[0 : side + 1, 0 : side + 1] / side * 3 - 1.5
    height = 0.02 * (np.sin(9 * x + 2 * y) + np.sin(7 * y - 5 * x + 1) + np.sin(12 * (x + y)))
    mesh = mi.Mesh("water", (side + 1) ** 2, 2 * side**2)
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = np.stack([x, height, -y], -1).astype(np.float32).ravel()
    a = (np.arange(side)[:, None] * (side + 1) + np.arange(side)).ravel()
    corners = np.stack([a, a + 1, a + side + 2, a, a + side + 2, a + side + 1], -1)
    parameters["faces"] = corners.astype(np.uint32).ravel()
    parameters.update()
    mesh.set_bsdf(mi.load_dict({"type": "dielectric", "int_ior": 1.333}))
    return {
        "ground": floor(mi, grey(0.6), -0.6, 1.5),
        "light": lamp(mi, [1, 4, -1], [0, 0, 0], 0.05, 2000),
        "water": mesh,
    }


@scene(depth=12, caustic=True)
def glass_in_a_mirror(mi: Any) -> Dict:
    """A glass ball and its caustic, both also seen in a mirror behind them."""
    mirror = {
        "type": "rectangle",
        "to_world": mi.ScalarTransform4f().translate([0, 0.3, -1.2]).scale([1.6, 0.8, 1]),
        "bsdf": {"type": "conductor", "material": "Ag"},
    }
    light = lamp(mi, [1.5, 3, 1.5], [0, 0, 0], 0.1, 500)
    return {"floor": floor(mi, grey()), "light": light, "ball": ball(0, GLASS, 0.4, -0.1), "mirror": mirror}
