"""Renders compared with closed forms, and the cost of spectral rendering: python benchmarks/spectral.py [prism bow ...]

prism    deviation of spectral lines of a slit seen through the prism of examples/prism, compared with Snell's law and
         Sellmeier's index (Schott2017)
window   the bright disk in examples/snells-window compared with asin(1/n)
bow      the bows of examples/rainbow compared with Descartes' angles
cusp     the caustic next to its cusp in examples/ring-caustic, with --integrator caustics, compared with
         1/a + 1/b = 2 / (R cos i)
time     a spectral render compared with one in RGB, same scene and samples, alternating in two processes
"""

from __future__ import annotations

import importlib.util
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import gonio as go
import numpy as np

EXAMPLES = Path(__file__).parents[1] / "examples"
WIDTH, HEIGHT, FOV = 1536, 4, 0.045  # pixels; vertical field of view in degrees
SLIT = 8.0  # distance of the slit from the prism
LINES = (467.8, 486.1, 546.1, 589.3, 656.3)  # nm: cadmium, hydrogen F, mercury e, sodium D, hydrogen C
TIMED = """
import sys, time, gonio as go

def render(spp):
    go.render(sys.argv[1], spp=spp, size=(480, 320), integrator="path", max_depth=8, spectral=sys.argv[2] == "spectral")

render(2)
print("ready", flush=True)
for _ in sys.stdin:
    start, busy = time.perf_counter(), time.process_time()
    render(128)
    print(time.perf_counter() - start, time.process_time() - busy, flush=True)
"""


def corners() -> np.ndarray:
    """The corners of the prism in plan view: (x, z) of the apex and of the left and right end of the base."""
    lines = (EXAMPLES / "prism/prism.obj").read_text().splitlines()
    found = np.array([[float(x) for x in line.split()[1:]] for line in lines if line.startswith("v ")])
    return found[found[:, 1] == 0.0][:, [0, 2]]


def refracted(way: np.ndarray, normal: np.ndarray, eta: float) -> np.ndarray:
    """A unit vector refracted at a surface (Snell's law). The normal faces it, eta is the index behind / in front."""
    cos = -way @ normal
    return way / eta + (cos / eta - np.sqrt(1.0 - (1.0 - cos**2) / eta**2)) * normal


def through(place: np.ndarray, way: np.ndarray, eta: float) -> tuple[np.ndarray, np.ndarray]:
    """A ray refracted by the two sides of the prism: the point where it leaves, and its direction."""
    apex, left, right = corners()
    for side, index in ((left, eta), (right, 1.0 / eta)):
        along = side - apex
        normal = np.array([along[1], -along[0]]) / np.linalg.norm(along)
        normal = -normal if normal @ way > 0.0 else normal
        place = place + way * ((apex - place) @ normal) / (way @ normal)
        way = refracted(way, normal, index)
    return place, way


def prism(lines: tuple[float, ...] = LINES) -> list[float]:
    """Errors in degrees of the deviation of each line, from renders of a slit through the prism.

    The slit is where a ray from the camera arrives at the middle wavelength.
    """
    errors = []
    print(f"{'nm':>6}  {'deviation':>10}  {'rendered':>10}  {'apart':>9}")
    eye, ahead = np.array([-6.0, 0.2576]), np.array([1.0, 0.0])
    middle = float(go.refractive_index("sf11", 550.0).eta)
    left_at, out = through(eye, ahead, middle)
    slit = left_at + SLIT * out
    across = np.array([-out[1], out[0]])
    for line in lines:
        light = {"type": "led", "peaks": [[line, 2, 1]]}
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "prism.obj").write_text((EXAMPLES / "prism/prism.obj").read_text())
            scene = {
                "output": {"filename": "prism.exr"},
                "sampler": {"type": "default", "samples": 256},
                "camera": {
                    "type": "pinhole",
                    "transform": {"position": [eye[0], 0.4, eye[1]], "lookAt": [0.0, 0.4, eye[1]], "up": [0, 1, 0]},
                    "verticalFov": FOV,
                    "film": {"size": [WIDTH, HEIGHT]},
                },
                "integrator": {"type": "path", "maxDepth": 4},
                "scene": {
                    "shapes": [
                        {
                            "type": "mesh",
                            "file": "prism.obj",
                            "material": {"type": "gonio-dielectric", "eta": "sf11", "alpha": 0},
                        }
                    ],
                    "lights": [
                        {
                            "type": "areaLight",
                            "energy": light,
                            "shape": {
                                "type": "parallelogram",
                                "base": [slit[0] - 0.003 * across[0], -5.0, slit[1] - 0.003 * across[1]],
                                "edge0": [0.006 * across[0], 0.0, 0.006 * across[1]],
                                "edge1": [0.0, 12.0, 0.0],
                            },
                        }
                    ],
                },
            }
            path = Path(folder) / "scene.json"
            path.write_text(json.dumps(scene))
            seen = np.abs(np.asarray(go.render(path, spp=2048, spectral=True), float)).sum((0, 2))
        seen[:470] = 0.0  # here is another image, of light reflected inside the prism
        near = np.abs(np.arange(WIDTH) - np.argmax(seen)) < 12
        column = (np.arange(WIDTH) + 0.5)[near] @ seen[near] / seen[near].sum()
        scale = 2.0 * np.tan(np.radians(FOV / 2.0)) / HEIGHT
        # right in the picture is the cross product of the camera's forward and up directions, here +z
        view = np.array([1.0, (column - WIDTH / 2.0) * scale])
        view /= np.linalg.norm(view)
        eta = float(go.refractive_index("sf11", line).eta)
        place, away = through(eye, view, eta)
        to_slit = (slit - place) / np.linalg.norm(slit - place)
        turned = [np.degrees(np.arccos(view @ w)) for w in (away, to_slit)]
        print(f"{line:6.1f}  {turned[0]:10.4f}  {turned[1]:10.4f}  {turned[1] - turned[0]:+9.5f}")
        errors.append(turned[1] - turned[0])
    return errors


def window(spp: int = 256) -> float:
    """Error in pixels of the radius of the bright disk, measured in 72 directions from its center.

    Toward its edge, the disk fades by Fresnel's law, from 50 % to 10 % within two pixels. The edge is taken at 10 %,
    since the radius of 50 % would be too small.
    """
    size = 480
    picture = np.asarray(go.render(EXAMPLES / "snells-window", size=(size, size), spp=spp), float)
    y, x = np.indices((size, size)) + 0.5 - size / 2.0
    bright = picture.mean(2)
    focal = size / 2.0 / np.tan(np.radians(55.0))
    radii = []
    for angle in np.linspace(0.0, 2.0 * np.pi, 73)[:-1]:
        near = np.abs(np.arctan2(y, x) - (angle if angle <= np.pi else angle - 2.0 * np.pi)) < 0.03
        r, values = np.hypot(x, y)[near], bright[near]
        steps = np.arange(160.0, 230.0, 0.25)
        share = np.array([values[np.abs(r - step) < 0.5].mean() for step in steps])
        inside, outside = share[:40].mean(), share[-40:].mean()
        radii.append(steps[np.argmax(share < outside + 0.1 * (inside - outside))])
    expected = focal * np.tan(np.arcsin(1.0 / 1.333))
    found = float(np.mean(radii))
    print(f"radius of the window: {found:.2f} pixels, asin(1/1.333) is {expected:.2f}; apart {found - expected:+.2f}")
    return found - expected


def bow(rays: int = 400_000) -> list[float]:
    """Errors in degrees of the bows."""
    spec = importlib.util.spec_from_file_location("rainbow", EXAMPLES / "rainbow/rainbow.py")
    assert spec is not None and spec.loader is not None
    program = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(program)
    return list(program.angles(rays))


def cusp(spp: int = 128) -> float:
    """Error in pixels of the caustic next to its cusp, viewed from above, for a lamp that is almost a point.

    A ray that meets the wall at an angle of incidence i after a distance a has its focus at the distance b:
    1/a + 1/b = 2 / (R cos i).
    """
    size, fov, height = 400, 12.0, 6.0
    camera = {"position": [0.47, height, 0], "lookAt": [0.47, 0, 0], "up": [0, 0, 1]}
    scene = json.loads((EXAMPLES / "ring-caustic/scene.json").read_text())
    scene["camera"] |= {"transform": camera, "verticalFov": fov, "film": {"size": [size, size]}}
    scene["scene"]["lights"] = scene["scene"]["lights"][:1]
    scene["scene"]["lights"][0]["shape"]["radius"] = 0.02
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "scene.json"
        path.write_text(json.dumps(scene))
        picture = np.asarray(go.render(path, spp=spp, integrator="caustics"), float).mean(2)
    pixel = 2.0 * height * np.tan(np.radians(fov / 2.0)) / size
    right = -1.0  # the cross product of forward and up is -x here
    x = 0.47 + right * (np.arange(size) + 0.5 - size / 2.0) * pixel
    angle = np.linspace(0.0, 0.6, 2001)
    wall = np.stack([np.cos(angle), np.sin(angle)], 1)
    ray = wall - [-8.0, 0.0]
    a = np.linalg.norm(ray, axis=1)
    cosine = np.sum(ray * wall, 1) / a
    away = ray / a[:, None] - 2.0 * cosine[:, None] * wall
    line = wall + away / (2.0 / cosine - 1.0 / a)[:, None]
    columns = np.flatnonzero((x > line[0, 0] + pixel) & (x < line[0, 0] + 21.0 * pixel))
    folded = picture[size // 2 :] + picture[: size // 2][::-1]  # sum of the two symmetric branches
    found = np.argmax(folded[:60], axis=0)[columns] + 0.5
    expected = np.interp(x[columns], line[:, 0], line[:, 1]) / pixel
    apart = found - expected
    print(f"caustic by its cusp at x = {line[0, 0]:.4f}: off by {np.mean(apart):+.2f} pixels on the mean of 20 columns")
    return float(np.mean(np.abs(apart)))


def time() -> None:
    """Medians of 7 alternating runs: wall-clock seconds, and CPU seconds, which other programs affect less."""
    for name in ("conductor-ggx", "rough-dielectric", "glass-caustic"):
        kinds = ("rgb", "spectral")
        command = [sys.executable, "-W", "ignore", "-c", TIMED, str(EXAMPLES / name)]
        pipes = [
            subprocess.Popen([*command, k], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) for k in kinds
        ]
        for one in pipes:
            assert one.stdout is not None and one.stdout.readline().strip() == "ready"
        taken = np.zeros((2, 7, 2))
        for turn in range(7):
            for kind, one in enumerate(pipes):
                assert one.stdin is not None and one.stdout is not None
                one.stdin.write("go\n")
                one.stdin.flush()
                taken[kind, turn] = [float(x) for x in one.stdout.readline().split()]
        for one in pipes:
            assert one.stdin is not None
            one.stdin.close()
            one.wait()
        rgb, spectral = np.median(taken, axis=1)
        wall, busy = np.median(taken[1] / taken[0], axis=0)
        print(
            f"{name:18s} rgb {rgb[0]:.2f} s, spectral {spectral[0]:.2f} s: {wall:.2f} times, of processors {busy:.2f}"
        )


if __name__ == "__main__":
    for one in sys.argv[1:] or ("prism", "window", "bow", "cusp", "time"):
        {"prism": prism, "window": window, "bow": bow, "cusp": cusp, "time": time}[one]()
