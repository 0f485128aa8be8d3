"""Godot 4: `light_compute` of the forward renderers, from the GLSL files of a checkout."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .....errors import InputError
from .....spirv.excerpts import functions_in

PACKAGE = "godot"
MARK = "servers/rendering/renderer_rd/shaders/scene_forward_lights_inc.glsl"
_SIZE, _SAMPLES = 128, 1024  # size of the table and number of samples in integrate_dfg.glsl


def tables(package: Path) -> dict[str, np.ndarray]:
    """The split-sum table that the renderer computes when it starts, with the channels bias, scale + bias and 0.

    The rows are ordered by decreasing roughness, the columns by n.v. The integral and its sample points are those of
    Karis, "Real Shading in Unreal Engine 4" (2013), with his masking for environments, k = alpha / 2. Row y is computed
    for the roughness (128 - y + 1/2) / 128, which is one texel more than the roughness for which it is read.
    """
    rows, columns = np.arange(_SIZE), np.arange(_SIZE)
    roughness, n_v = (_SIZE - rows + 0.5) / _SIZE, (columns + 0.5) / _SIZE
    view = np.stack([np.sqrt(1 - n_v**2), np.zeros(_SIZE), n_v], axis=-1)
    index = np.arange(_SAMPLES, dtype=np.uint32)
    bits = np.unpackbits(index.view(np.uint8).reshape(-1, 4), axis=-1, bitorder="little")
    azimuth, height = 2 * np.pi * index / _SAMPLES, bits @ 0.5 ** np.arange(1.0, 33.0)  # van der Corput's sequence
    table = np.zeros((_SIZE, _SIZE, 3))
    for row, rough in enumerate(roughness):
        alpha = rough**2
        cosine = np.sqrt((1 - height) / (1 + (alpha**2 - 1) * height))
        sine = np.sqrt(1 - cosine**2)
        # the tangent frame of integrate_dfg.glsl is rotated by a quarter turn: t = (0, 1, 0), b = (-1, 0, 0)
        half = np.stack([-np.sin(azimuth) * sine, np.cos(azimuth) * sine, cosine], axis=-1)
        v_h = view @ half.T
        n_l = np.clip(2 * v_h * cosine - n_v[:, None], 0, 1)
        v_h = np.clip(v_h, 0, 1)
        masking = _schlick(n_l, alpha / 2) * _schlick(n_v, alpha / 2)[:, None]
        weight = np.where(n_l > 0, masking * v_h / (cosine * n_v[:, None]), 0)
        table[row, :, 0] = np.mean(weight * (1 - v_h) ** 5, axis=-1)
        table[row, :, 1] = np.mean(weight, axis=-1)
    return {"dfg": table.astype(np.float16).astype(np.float64)}


def replaced(package: Path) -> dict[str, str]:
    """The defines in the adapters that depend on the checkout, that is, on the arguments of its `light_compute`."""
    path = package / MARK
    try:
        text, _ = functions_in(path.read_text(encoding="utf-8", errors="replace"), "light_compute", str(path))
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", str(path), "use Godot 4.3 or later") from None
    arguments = text.partition("{")[0]
    known = ["f0", "diffuse_light", "specular_light", "is_directional", "albedo"]
    if missing := [name for name in known if name not in arguments]:
        raise InputError(f"light_compute has no argument {missing[0]}", str(path), "use Godot 4.3 or later")
    defined = {"half": "GODOT_HALF", "uint orms": "GODOT_PACKED", "screen_uv": "GODOT_SCREEN"}
    defined["energy_compensation"] = "GODOT_COMPENSATION"
    defines = [define for argument, define in defined.items() if argument in arguments]
    return {"GODOT_ARGUMENTS": ' = "", '.join(defines) or "GODOT_PLAIN"}


def _schlick(cosine: np.ndarray, k: float) -> np.ndarray:
    """Schlick's masking function, x / (x (1 - k) + k)."""
    return cosine / (cosine * (1 - k) + k)
