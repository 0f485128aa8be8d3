"""Render the photographs of a calibration, to test a setup, a plan or a fit before anything is built.

rehearsal.take(calibration, go.Conductor(alpha=0.2), "photographs", noise=0.01)
go.capture("photographs", "conductor")
"""

from __future__ import annotations

import json
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ... import files
from ...bridge.types import Json
from ...errors import InputError
from ...material import BSDF
from ...owner import public
from ...pictures import images
from ...render.execute import execute
from ...render.finish import picture_of
from ...render.prepare import prepare
from ...render.request import Request
from .calibration import NAME, Calibration, Floats, made
from .series import Noise


@public
def take(
    calibration: Mapping[str, Json],
    material: BSDF,
    folder: str | Path,
    *,
    noise: float | Noise = 0.0,
    bits: int | None = None,
    spp: int = 16,
    seed: int = 1,
    stated: Mapping[str, Json] | None = None,
) -> Path:
    """Render the photographs of a calibration into a folder, write a calibration file, and return the folder.

    calibration  contents of a calibration file with the positions of ball and lamps, and without lens distortion
    material     material of the sample
    folder       the folder to which the files are written
    noise        relative standard deviation of each value, or the `Noise` of a camera
    bits         8 or 16 for integer .png files, encoded by the response in the calibration, which is linear or srgb for
                 8 bits and linear for 16 bits; None for radiance in .exr, .hdr or .npz files. The calibration must name
                 files of this kind
    spp          samples per pixel
    seed         seed of the renders and of the noise
    stated       the calibration to write; it may differ from `calibration`, in order to simulate calibration errors
    """
    told = made(calibration, Path("calibration"))
    target = files.check_folder(folder)
    target.mkdir(exist_ok=True)
    rng = np.random.default_rng([seed, 41])
    for shot in told.photographs:
        radiance = _rendered(told, shot.light, shot.sample, material, spp, seed)
        for one in shot.pictures:
            if one.seconds is None:
                raise InputError(f"no exposure time of '{one.file}'", "calibration", 'add "seconds"')
            values = _noisy(radiance * one.seconds, noise, rng)
            path = target / one.file
            if bits is None:
                images.write(path, values.astype(np.float32))
            elif bits in (8, 16):
                files.write_whole(path, images.png_bytes(_stored(values, told, bits)))
            else:
                raise InputError(f"{bits} bits given, 8, 16 or None expected", "bits")
    text = json.dumps(dict(stated if stated is not None else calibration), indent=1)
    files.write_whole(target / NAME, text.encode())
    return target


def _noisy(signal: Floats, noise: float | Noise, rng: np.random.Generator) -> Floats:
    """Add the noise of a camera to a signal (H, W, 3)."""
    if not isinstance(noise, Noise):
        return np.asarray(signal * (1.0 + noise * rng.normal(size=signal.shape)))
    gain = np.maximum(noise.gain, 1e-12)
    photons = np.minimum(np.maximum(signal, 0.0) / gain, 1e15)  # for more photons, the noise is negligible
    read, relative = (np.sqrt(part) * rng.normal(size=signal.shape) for part in (noise.read, noise.relative))
    return np.asarray(rng.poisson(photons) * gain + read + relative * signal)


def _stored(values: Floats, calibration: Calibration, bits: int) -> np.ndarray:
    if calibration.response == "srgb" and bits == 8:
        return images.to_screen(values.astype(np.float32))
    if calibration.response != "linear":
        raise InputError(
            "this response cannot be rehearsed", "calibration", '"linear", or "srgb" with 8 bits, expected'
        )
    highest = 2**bits - 1
    return (np.clip(values, 0.0, 1.0) * highest + 0.5).astype(np.uint8 if bits == 8 else np.uint16)


def _rendered(calibration: Calibration, light: str, sample: str, material: BSDF, spp: int, seed: int) -> Floats:
    """The radiance of the sample under one lamp, rendered by Gonio."""
    camera, lamp = calibration.camera, calibration.lights[light]
    if lamp.position is None or camera.k1 or camera.k2:
        raise InputError("lamps with positions and a lens without distortion expected", "calibration")
    width, height = camera.size
    if camera.center != (0.5 * width, 0.5 * height):
        raise InputError("the optical axis must meet the middle of the picture", "calibration")
    shapes: list[dict[str, Any]] = []
    if sample == "ball":
        ball = calibration.ball
        if ball is None or ball.center is None:
            raise InputError("a ball with its center expected", "calibration")
        shapes.append({"type": "sphere", "center": list(ball.center), "radius": ball.radius})
    else:
        flat = calibration.flat if sample == "flat" else calibration.reference
        assert flat is not None, "checked when it was read"
        edges = {"base": list(flat.base), "edge0": list(flat.edge0), "edge1": list(flat.edge1)}
        shapes.append({"type": "parallelogram", **edges})
    intensity = calibration.intensity(light)
    if intensity is None:
        raise InputError(f"the light '{light}' has no intensity", "calibration")
    if sample == "reference":
        assert calibration.reference is not None, "checked when it was read"
        albedo = calibration.reference.albedo
        shapes[0]["material"] = {"type": "matte", "albedo": [albedo] * 3 if isinstance(albedo, float) else list(albedo)}
    scene = {
        "output": {"filename": "photograph.npz"},
        "sampler": {"type": "independent", "samples": spp},
        "camera": {
            "type": "pinhole",
            "transform": {"position": [0, 0, 0], "lookAt": [0, 0, 1], "up": [0, -1, 0]},
            "verticalFov": float(np.degrees(2.0 * np.arctan(0.5 * height / camera.focal_pixels))),
            "film": {"size": [width, height]},
        },
        "integrator": {"type": "direct"},
        "scene": {
            "shapes": shapes,
            "lights": [{"type": "spotLight", "position": list(lamp.position), "energy": [float(x) for x in intensity]}],
        },
    }
    with tempfile.TemporaryDirectory(prefix="gonio-") as folder:
        (Path(folder) / "scene.json").write_text(json.dumps(scene))
        overrides = {} if sample == "reference" else {"shapes.0.material": material}
        prepared = prepare(Request(Path(folder), output=Path(folder) / "p.npz", overrides=overrides, seed=seed))
        execute(prepared)
        return np.asarray(picture_of(prepared.render, False), np.float64)
