"""Convert photographs to radiance: decode and linearize files, divide by exposure times, and merge exposures."""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...pictures import formats, images, openexr
from . import series
from .calibration import Calibration, Exposure, Shot
from .series import Exposed, Noise
from .shutter import Ratio, Shutter, estimated

Floats = NDArray[np.float64]
STEPS = 255  # quantization steps of an 8-bit file, the smallest bit depth of cameras


@dataclass(frozen=True)
class Photograph:
    """A photograph, converted to radiance in the linear unit of the camera per second.

    name         name of the file; for a series, of its first file
    shot         entry in the calibration
    radiance     (H, W, 3); nan where every exposure is saturated
    step         (H, W, 3), standard deviation due to quantization and, for a series, also photon and read noise
    photon       (H, W, 3), derivative of step^2 with respect to the radiance; 0 if the noise is unknown
    noise        noise of the camera, estimated from a series of exposures
    scale_error  relative error common to all radiance, due to errors of exposure times
    ratios       measured ratios of exposure times
    seconds      stated exposure times, s
    cut          whether negative noise was stored as 0 and its standard deviation is known
    """

    name: str
    shot: Shot
    radiance: Floats
    step: Floats
    photon: Floats = field(default_factory=lambda: np.zeros(()))
    noise: Noise | None = None
    scale_error: float = 0.0
    ratios: Sequence[Ratio] = ()
    seconds: tuple[float, ...] = ()
    cut: bool = False

    @property
    def saturated(self) -> NDArray[np.bool_]:
        return np.asarray(np.isnan(self.radiance).any(axis=-1))


def read_all(
    calibration: Calibration, folder: Path, progress: Callable[[str], None] = lambda text: None
) -> list[Photograph]:
    """Read all photographs of a calibration.

    The errors of exposure times are estimated from all series. If there are such errors, the series are merged again
    with corrected times.

    progress  called before each photograph, with the name of its first file
    """
    pictures = []
    for shot in calibration.photographs:
        progress(shot.pictures[0].file)
        pictures.append(read(shot, calibration, folder))
    ratios = [ratio for one in pictures for ratio in one.ratios]
    seconds = [one for picture in pictures for one in picture.seconds]
    shutter = estimated(ratios, seconds, calibration.uncertainty.seconds)
    if shutter.covariance.any() or any(one.scale_error for one in pictures):
        pictures = [read(one.shot, calibration, folder, shutter) for one in pictures]
    return pictures


def read(shot: Shot, calibration: Calibration, folder: Path, shutter: Shutter | None = None) -> Photograph:
    """Read a photograph and merge its exposures. Raises InputError, with the name of the file, if it is unusable.

    folder   the folder that contains the files
    shutter  errors of the exposure times; None estimates them from this series
    """
    exposures = [_exposed(one, calibration, folder) for one in shot.pictures]
    merged = series.merge(exposures, calibration.uncertainty.seconds, shutter)
    noise = merged.noise if len(exposures) > 1 else None
    photograph = Photograph(
        str(folder / shot.pictures[0].file),
        shot,
        merged.light,
        merged.spread,
        merged.photon,
        noise,
        merged.scale_error,
        merged.ratios,
        tuple(one.seconds for one in exposures),
        noise is not None and noise.known and exposures[0].clips,
    )
    if photograph.saturated.all():
        hint = "expose it for a shorter time, or add such an exposure"
        raise InputError("saturated throughout", photograph.name, hint)
    return photograph


def _exposed(one: Exposure, calibration: Calibration, folder: Path) -> Exposed:
    """Read a picture as a linear signal, which is nan where saturated."""
    path = folder / one.file
    where = str(path)
    try:
        content = path.read_bytes()
    except (OSError, ValueError) as error:
        what = f"cannot read this photograph: {getattr(error, 'strerror', None) or error}"
        raise InputError(what, where, "check the name in the calibration file") from None
    integers = False
    if path.suffix.lower() == ".npz":
        values = np.asarray(images.read(path).pixels, np.float64)
    else:
        kind = formats.kind_of(content)
        if kind is None:
            raise InputError("no picture of a known format", where, "give .png, .jpg, .exr, .hdr or .npz")
        try:
            decoded = formats.decode(path, content, kind)
        except formats.Unreadable as error:
            raise InputError(f"this photograph is damaged: {error}", where, "copy it again") from None
        values, integers = decoded.values.astype(np.float64), decoded.integers
    values = values[..., :1].repeat(3, axis=2) if values.shape[2] < 3 else values[..., :3]
    height, width = values.shape[:2]
    if (width, height) != tuple(calibration.camera.size):
        expected = "x".join(map(str, calibration.camera.size))
        raise InputError(
            f"{width}x{height} pixels, {expected} expected, the size of the camera", where, "do not crop or scale"
        )
    if not np.isfinite(values).all():
        raise InputError("some values are not finite", where, "export the photograph again")
    seconds = one.seconds if one.seconds is not None else _own_seconds(content)
    if seconds is None:
        raise InputError("no exposure time", where, 'add "seconds" in the calibration file')
    if not integers:
        return Exposed(where, values, np.zeros_like(values), seconds, np.inf)
    steps = 65535 if _sixteen(values) else STEPS
    clipped = values >= calibration.saturation
    high, low = (_light(values + side * 0.5 / steps, calibration) for side in (1.0, -1.0))
    light = np.where(clipped, np.nan, _light(values, calibration))
    ceiling = float(_light(np.array(calibration.saturation), calibration))
    return Exposed(where, light, (high - low) / np.sqrt(12.0), seconds, ceiling)


def _sixteen(values: Floats) -> bool:
    """Whether the values need more than 8 bits."""
    sample = values[:: max(1, len(values) // 64)].ravel() * STEPS
    return bool(np.abs(sample - np.round(sample)).max() > 1e-3)


def _light(values: Floats, calibration: Calibration) -> Floats:
    """Convert the values of a file to light, by the camera's response."""
    response = calibration.response
    if response == "linear":
        return values
    inside = np.clip(values, 0.0, 1.0)
    if response == "srgb":
        return images.from_screen(inside).astype(np.float64)
    curve = np.array(response)
    return np.interp(inside, curve[:, 0], curve[:, 1])


# ---------------------------------------------------------------------- exposure times in files


def _own_seconds(content: bytes) -> float | None:
    """The exposure time stored in an OpenEXR file (`expTime`) or in the EXIF data of a JPEG file; None if missing."""
    seconds: float | None = None
    try:
        if formats.kind_of(content) == "OpenEXR":
            for name, kind, value in openexr.attributes_of(content):
                if name == "expTime" and kind == "float":
                    seconds = float(struct.unpack("<f", value)[0])
        elif content.startswith(b"\xff\xd8"):
            seconds = _exif_seconds(content)
    except (struct.error, IndexError, formats.Unreadable):
        return None
    return seconds if seconds is not None and np.isfinite(seconds) and seconds > 0.0 else None


def _exif_seconds(content: bytes) -> float | None:
    """ExposureTime, tag 0x829A of the EXIF directory, to which tag 0x8769 of the first directory points.

    See CIPA DC-008, 4.6.
    """
    at = content.find(b"Exif\0\0", 0, 1 << 16)
    if at < 0:
        return None
    tiff = content[at + 6 : at + 6 + (1 << 16)]
    order = "<" if tiff[:2] == b"II" else ">"

    def entries(offset: int) -> dict[int, int]:
        (count,) = struct.unpack_from(order + "H", tiff, offset)
        rows = (struct.unpack_from(order + "HHII", tiff, offset + 2 + 12 * n) for n in range(count))
        return {tag: value for tag, _, _, value in rows}

    (first,) = struct.unpack_from(order + "I", tiff, 4)
    inner = entries(first).get(0x8769)
    place = entries(inner).get(0x829A) if inner is not None else None
    if place is None:
        return None
    above, below = struct.unpack_from(order + "II", tiff, place)
    return above / below if below else None
