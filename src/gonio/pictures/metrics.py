"""Differences between two pictures: RMSE, relMSE, mean ratio, and FLIP.

All metrics take two linear RGB pictures of shape (H, W, 3), `test` and `reference`, with row 0 on top. FLIP predicts
the differences that a person perceives when the two pictures alternate. It models the contrast sensitivity of the eye,
color differences, edges and points, as in [Andersson2020]. For high-dynamic-range pictures, it is the maximum over the
exposures at which the reference can be shown, as in [Andersson2021].
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import correlate1d

from .. import _html
from ..errors import InputError, did_you_mean

Floats = NDArray[np.floating]

# for a monitor with a width of 0.7 m and 3840 pixels, viewed from a distance of 0.7 m [Andersson2020, section 6]
PIXELS_PER_DEGREE = 0.7 * (3840 / 0.7) * math.pi / 180

# This is added to r^2 in the denominator of relMSE, so that black pixels of the reference do not dominate the mean. It
# limits the weight of a squared difference to 100.
RELATIVE_FLOOR = 0.01


METRICS: dict[str, str] = {
    "rmse": "root of the mean squared difference, in the picture's own unit",
    "relmse": "mean of (x - r)^2 / (r^2 + 0.01)",
    "flip": "mean FLIP, 0 (same) to 1: the visible difference when flipping between the two",
}


READ_AS = {
    "srgb": "sRGB, decoded to linear values (.png); --encoding linear reads data, such as tables, as stored",
    "linear": "data, as stored (.png)",
}


@dataclass(frozen=True)
class Tolerance:
    """The metric of a comparison, and the largest value that passes; None if any value passes."""

    metric: str = "relmse"
    most: float | None = None

    def __post_init__(self) -> None:
        if self.metric not in METRICS:
            raise InputError(f"unknown metric '{self.metric}'", "--metric", did_you_mean(self.metric, tuple(METRICS)))
        if self.most is not None and not self.most >= 0:
            raise InputError(f"a tolerance of {self.most:g}", "--tolerance", "give 0 or more")


@dataclass(frozen=True)
class Comparison:
    """The results of `gonio compare`.

    exposures  first and last exposure of HDR-FLIP in stops; None for LDR-FLIP
    encoding   encoding with which .png files were read; None if there were no such files
    """

    rmse: float
    relmse: float
    mean_ratio: float
    flip: float
    exposures: tuple[float, float] | None
    tolerance: Tolerance
    encoding: str | None = None

    def value(self, metric: str) -> float:
        return {"rmse": self.rmse, "relmse": self.relmse, "flip": self.flip}[metric]

    @property
    def passed(self) -> bool:
        return self.tolerance.most is None or self.value(self.tolerance.metric) <= self.tolerance.most

    def as_dict(self) -> dict[str, object]:
        judged = {"metric": self.tolerance.metric, "tolerance": self.tolerance.most, "passed": self.passed}
        return {**asdict(self), **judged}

    def rows(self) -> dict[str, str]:
        """The results as text, by name."""
        kind = "LDR" if self.exposures is None else "HDR, {:+.1f} to {:+.1f} EV".format(*self.exposures)
        rows = {
            "RMSE": f"{self.rmse:.6g}",
            "relMSE": f"{self.relmse:.6g}",
            "mean ratio": f"{self.mean_ratio:.6f}",
            "FLIP": f"{self.flip:.6f}  ({kind})",
        }
        if self.encoding is not None:
            rows["read as"] = READ_AS[self.encoding]
        metric, most = self.tolerance.metric, self.tolerance.most
        if most is not None:
            relation = "<=" if self.passed else ">"
            rows["passes" if self.passed else "fails"] = f"{metric} {self.value(metric):.6g} {relation} {most:g}"
        return rows

    def _repr_html_(self) -> str:
        return _html.table(self.rows().items())


def _pair(test: Floats, reference: Floats) -> tuple[Floats, Floats]:
    a, b = np.asarray(test, np.float64), np.asarray(reference, np.float64)
    if a.shape != b.shape:
        raise InputError(f"the pictures differ in size: {_size(a)} and {_size(b)}", "", "render both at one --size")
    if a.ndim != 3 or a.shape[2] != 3 or a.size == 0:
        raise InputError(f"expected an RGB picture of shape (H, W, 3), got {a.shape}")
    for name, picture in (("first", a), ("second", b)):
        bad = int(np.count_nonzero(~np.isfinite(picture)))
        if bad:
            raise InputError(f"the {name} picture has {bad} values that are not finite")
    return a, b


def _size(picture: Floats) -> str:
    return f"{picture.shape[1]}x{picture.shape[0]}" if picture.ndim >= 2 else str(picture.shape)


def rmse(test: Floats, reference: Floats) -> float:
    """The root-mean-square error sqrt(mean((x - r)^2)), over all pixels and channels."""
    a, b = _pair(test, reference)
    return float(np.sqrt(np.mean((a - b) ** 2)))


def relmse_map(test: Floats, reference: Floats) -> Floats:
    """The squared relative error per pixel, (x - r)^2 / (r^2 + 0.01), averaged over the channels, (H, W)."""
    a, b = _pair(test, reference)
    return ((a - b) ** 2 / (b**2 + RELATIVE_FLOOR)).mean(axis=2)


def relmse(test: Floats, reference: Floats) -> float:
    """The mean squared relative error, mean((x - r)^2 / (r^2 + 0.01)), which is bounded for dark pixels."""
    return float(relmse_map(test, reference).mean())


def mean_ratio(test: Floats, reference: Floats) -> float:
    """The ratio of the means, mean(x) / mean(r), which is 1 if energy is conserved; NaN if the reference is black."""
    a, b = _pair(test, reference)
    return float(a.mean() / b.mean()) if b.mean() != 0 else (1.0 if a.mean() == 0 else math.nan)


def compare(test: Floats, reference: Floats, hdr: bool = True, tolerance: Tolerance = Tolerance()) -> Comparison:
    """Compute all metrics.

    hdr        whether FLIP is HDR-FLIP; if False, the pictures are clamped to [0, 1], as on a screen
    tolerance  the metric and value that decide whether the comparison passes
    """
    _pair(test, reference)
    exposures = exposure_range(reference) if hdr else None
    return Comparison(
        rmse(test, reference),
        relmse(test, reference),
        mean_ratio(test, reference),
        float(flip_map(test, reference, hdr).mean()),
        exposures,
        tolerance,
    )


# --- FLIP ------------------------------------------------------------------------------------------------
# NVIDIA's package `flip-evaluator` is not used, because version 1.7 supports neither Python 3.14 nor Linux on ARM. Its
# results agree with those of this module: for the 16 pictures of examples/, with 20 % noise, the means differ by at
# most 7e-6, and single pixels by at most 4e-5 (the package computes in float32).

_XYZ_FROM_RGB = np.array(  # linear sRGB to CIE XYZ with the D65 white of [Andersson2020]
    [
        [10135552 / 24577794, 8788810 / 24577794, 4435075 / 24577794],
        [2613072 / 12288897, 8788810 / 12288897, 887015 / 12288897],
        [1425312 / 73733382, 8788810 / 73733382, 70074185 / 73733382],
    ]
)
_RGB_FROM_XYZ = np.linalg.inv(_XYZ_FROM_RGB)
_WHITE = _XYZ_FROM_RGB.sum(axis=1)

_HYAB_POWER = 0.7  # q_c, [Andersson2020, section 4.1.3], which compresses large color distances
_KNEE_IN, _KNEE_OUT = 0.4, 0.95  # p_c, p_t: 40 % of the largest distance is mapped to 0.95
_FEATURE_WIDTH = 0.082  # w, the width of an edge or point that the eye detects, degrees
_FEATURE_POWER = 0.5  # q_f

# Contrast sensitivity as sums of Gaussians, (a1, b1, a2, b2), for the achromatic, red-green and blue-yellow channels
# [Andersson2020, table 1]
_SENSITIVITY = (
    (1.0, 0.0047, 0.0, 1e-5),
    (1.0, 0.0053, 0.0, 1e-5),
    (34.1, 0.04, 13.5, 0.025),
)


def flip_map(test: Floats, reference: Floats, hdr: bool = True, pixels_per_degree: float = PIXELS_PER_DEGREE) -> Floats:
    """The FLIP error of each pixel, (H, W), from 0 to 1.

    If `hdr` is False, the pictures are clamped to [0, 1] and compared as a screen would show them. If it is True, they
    are tone mapped (ACES) at several exposures, and the maximum over the exposures is used for each pixel
    [Andersson2021, eq. 6]. The exposures depend only on the reference (see `exposure_range`), so HDR-FLIP is not
    symmetric: swapping the pictures changes the exposures.
    """
    a, b = _pair(test, reference)
    if not hdr:
        return _ldr_flip(np.clip(a, 0, 1), np.clip(b, 0, 1), pixels_per_degree)
    start, stop = exposure_range(b)
    count = max(2, math.ceil(stop - start))  # one exposure per stop [Andersson2021, section 3.2]
    worst = np.zeros(a.shape[:2])
    for exposure in np.linspace(start, stop, count):
        test_shown, reference_shown = (_aces(np.maximum(x, 0) * 2.0**exposure) for x in (a, b))
        np.maximum(worst, _ldr_flip(test_shown, reference_shown, pixels_per_degree), out=worst)
    return worst


_ACES = (0.6 * 0.6 * 2.51, 0.6 * 0.03, 0.0, 0.6 * 0.6 * 2.43, 0.6 * 0.59, 0.14)


def _aces(x: Floats) -> Floats:
    k0, k1, k2, k3, k4, k5 = _ACES
    return np.clip((k0 * x * x + k1 * x + k2) / (k3 * x * x + k4 * x + k5), 0, 1)


def exposure_range(reference: Floats) -> tuple[float, float]:
    """The first and last exposure of HDR-FLIP in stops.

    At these exposures, ACES maps the brightest pixel and the median of the reference to 0.85 [Andersson2021, section
    3.2].
    """
    k0, k1, k2, k3, k4, k5 = _ACES
    a, b, c = k0 - 0.85 * k3, k1 - 0.85 * k4, k2 - 0.85 * k5
    x_max = -b / (2 * a) + math.sqrt((b / (2 * a)) ** 2 - c / a)  # solves _aces(x) = 0.85
    luminance = np.maximum(np.asarray(reference, np.float64), 0) @ _XYZ_FROM_RGB[1]
    if luminance.max() <= 0:
        return 0.0, 0.0  # a black reference is compared at exposure 0
    # A black median would require infinitely many stops; 2^-23 of the peak is the limit of float32 resolution.
    median = max(float(np.median(luminance)), float(luminance.max()) * 2.0**-23)
    return math.log2(x_max / luminance.max()), math.log2(x_max / median)


def _ldr_flip(test: Floats, reference: Floats, pixels_per_degree: float) -> Floats:
    """LDR-FLIP of two linear RGB pictures in [0, 1]: dE_c^(1 - dE_f) [Andersson2020, eq. 5]."""
    a, b = _opponent(test), _opponent(reference)
    distance = _color_distance(a, b, pixels_per_degree)
    features = _feature_distance((a[..., 0] + 16) / 116, (b[..., 0] + 16) / 116, pixels_per_degree)
    return distance ** (1 - features)


def _opponent(rgb: Floats) -> Floats:
    """Convert linear RGB to YyCxCz, a linear variant of L*a*b* in which the contrast filters are applied."""
    x, y, z = np.moveaxis(rgb @ _XYZ_FROM_RGB.T / _WHITE, -1, 0)
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], axis=-1)


def _from_opponent(ycc: Floats) -> Floats:
    y = (ycc[..., 0] + 16) / 116
    xyz = np.stack([y + ycc[..., 1] / 500, y, y - ycc[..., 2] / 200], axis=-1) * _WHITE
    return xyz @ _RGB_FROM_XYZ.T


def _hunt_lab(rgb: Floats) -> Floats:
    """Convert to L*a*b* with the Hunt adjustment.

    a and b are multiplied by 0.01 L, because brighter colors appear more saturated.
    """
    t = rgb @ _XYZ_FROM_RGB.T / _WHITE
    delta = 6 / 29
    x, y, z = np.moveaxis(np.where(t > delta**3, np.cbrt(t), t / (3 * delta**2) + 4 / 29), -1, 0)
    lightness = 116 * y - 16
    return np.stack([lightness, 5 * lightness * (x - y), 2 * lightness * (y - z)], axis=-1)


def _hyab(a: Floats, b: Floats) -> Floats:
    """The HyAB color distance: city-block distance in lightness plus Euclidean distance in chroma.

    For large differences, it is more accurate than either distance alone.
    """
    difference = a - b
    return np.abs(difference[..., 0]) + np.hypot(difference[..., 1], difference[..., 2])


def _color_distance(test: Floats, reference: Floats, pixels_per_degree: float) -> Floats:
    def perceived(ycc: Floats) -> Floats:
        filtered = np.stack(
            [_contrast_filter(ycc[..., i], *_SENSITIVITY[i], pixels_per_degree) for i in range(3)], axis=-1
        )
        return _hunt_lab(np.clip(_from_opponent(filtered), 0, 1))

    power = _hyab(perceived(test), perceived(reference)) ** _HYAB_POWER
    green, blue = _hunt_lab(np.eye(3)[1]), _hunt_lab(np.eye(3)[2])  # the most distant pair in the sRGB cube
    largest = float(_hyab(green, blue)) ** _HYAB_POWER
    knee = _KNEE_IN * largest
    return np.where(
        power < knee, power * (_KNEE_OUT / knee), _KNEE_OUT + (power - knee) / (largest - knee) * (1 - _KNEE_OUT)
    )


def _contrast_filter(channel: Floats, a1: float, b1: float, a2: float, b2: float, pixels_per_degree: float) -> Floats:
    """Filter a channel by the contrast sensitivity of the eye, a normalized sum of two separable Gaussians."""
    widest = max(b for row in _SENSITIVITY for b in (row[1], row[3]))
    radius = math.ceil(3 * math.sqrt(widest / (2 * math.pi**2)) * pixels_per_degree)
    x = np.arange(-radius, radius + 1) / pixels_per_degree
    total, weight = np.zeros_like(channel), 0.0
    for a, b in ((a1, b1), (a2, b2)):
        if a == 0:
            continue
        line = np.exp(-(math.pi**2) * x * x / b)
        scale = a * math.sqrt(math.pi / b)
        total += scale * _filtered(channel, line, line)
        weight += scale * line.sum() ** 2
    return total / weight


def _feature_distance(test: Floats, reference: Floats, pixels_per_degree: float) -> Floats:
    """The larger of the edge difference and the point difference [Andersson2020, eq. 4]."""
    sigma = 0.5 * _FEATURE_WIDTH * pixels_per_degree
    radius = math.ceil(3 * sigma)
    x = np.arange(-radius, radius + 1, dtype=np.float64)
    gauss = np.exp(-x * x / (2 * sigma * sigma))
    edge, point = -x * gauss, (x * x / sigma**2 - 1) * gauss

    def strength(luminance: Floats, detector: Floats) -> Floats:
        # The positive weights and the negative weights each sum to one, as in the two-dimensional filter.
        across = gauss / gauss.sum()
        along = np.where(detector < 0, detector / -detector[detector < 0].sum(), 0)
        along = along + np.where(detector > 0, detector / detector[detector > 0].sum(), 0)
        return np.hypot(_filtered(luminance, across, along), _filtered(luminance, along, across))

    edges, points = (np.abs(strength(reference, x) - strength(test, x)) for x in (edge, point))
    return np.clip((np.maximum(edges, points) / math.sqrt(2)) ** _FEATURE_POWER, 0, 1)


def _filtered(channel: Floats, down: Floats, right: Floats) -> Floats:
    """Correlate with the outer product of a column filter and a row filter; border pixels are repeated outward.

    Correlation and convolution differ by a reflection. This does not matter, because only the edge detector is odd, and
    only its absolute value is used.
    """
    return correlate1d(correlate1d(channel, down, 0, mode="nearest"), right, 1, mode="nearest")
