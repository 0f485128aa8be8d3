"""Denoise pictures with Intel Open Image Denoise (OIDN).

OIDN is installed with Gonio on platforms for which there is a wheel of pyoidn.
"""

from __future__ import annotations

import numpy as np

from ..errors import InputError, MachineError

INSTALL = "pip install pyoidn (Linux x86-64, Windows, macOS)"
_HINT = f"{INSTALL}, or leave --denoise out"


def available() -> str:
    """The version of the installed pyoidn, or "" if it is not installed. The library is not loaded."""
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version("pyoidn")
    except PackageNotFoundError:
        return ""


def require() -> None:
    """Raise MachineError if OIDN is missing. This is called before a render, so that no time is lost."""
    if not available():
        raise MachineError("Open Image Denoise (pyoidn) is not installed", "--denoise", _HINT)


def denoise(image: np.ndarray, albedo: np.ndarray | None = None, normal: np.ndarray | None = None) -> np.ndarray:
    """Denoise a picture, (H, W, 3), float32, of linear radiance without an upper bound.

    albedo  surface colors in [0, 1], which may be noisy; they preserve edges of textures
    normal  shading normals in [-1, 1]; they preserve edges of geometry, and require `albedo`
    The result is biased: fine detail may be removed as noise. Values that are not finite are replaced by 0.
    Raises MachineError if OIDN is missing or fails, InputError for arrays of other shapes.
    """
    color = _checked("image", image, np.asarray(image).shape)
    guides = {
        name: np.clip(_checked(name, guide, color.shape), low, 1)
        for name, guide, low in (("albedo", albedo, 0), ("normal", normal, -1))
        if guide is not None
    }
    if "normal" in guides and "albedo" not in guides:
        raise InputError("a normal map alone cannot guide the denoiser", "normal", "give albedo too")
    require()
    try:
        from pyoidn.denoise import denoise as filter_picture

        return np.asarray(filter_picture(np.maximum(color, 0), hdr=True, **guides))
    except ImportError as error:
        raise MachineError(f"pyoidn {available()} cannot be used: {error}", "--denoise", _HINT) from error
    except (RuntimeError, OSError) as error:
        raise MachineError(f"Open Image Denoise failed: {error}", "--denoise", _HINT) from error


def _checked(name: str, picture: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    array = np.nan_to_num(np.ascontiguousarray(picture, np.float32), nan=0.0, posinf=0.0, neginf=0.0)
    if array.ndim != 3 or array.shape[2] != 3 or array.shape != tuple(shape):
        expected = "(H, W, 3)" if name == "image" else str(tuple(shape))
        raise InputError(f"'{name}' has shape {array.shape}, expected {expected}", name)
    return array
