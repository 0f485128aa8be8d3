"""Solutions of the courses' tasks as students write them: from the formulas of the sheets, in angles, loops and float32
text, each with at most one mistake. Nothing here uses Gonio.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

PAIRS = 200


def hemisphere(count: int, seed: int) -> np.ndarray:
    """Uniform directions with z up, (count, 3)."""
    rng = np.random.default_rng(seed)
    z, phi = rng.random(count), 2.0 * math.pi * rng.random(count)
    r = np.sqrt(1.0 - z * z)
    return np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=1)


WO, WI = hemisphere(PAIRS, 11), hemisphere(PAIRS, 12)


def angles(w: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return np.arccos(w[:, 2]), np.arctan2(w[:, 1], w[:, 0])


# --------------------------------------------------------------------------- lab 2


@dataclass
class OrenNayar:
    """Equations 2 and 3 of the sheet."""

    sigma: float = 0.3
    albedo: float = 0.5
    change: str = ""

    def __call__(self, o: np.ndarray, i: np.ndarray) -> np.ndarray:
        (to, po), (ti, pi) = angles(o), angles(i)
        sigma = self.sigma
        if self.change == "sigma in degrees":
            sigma = math.radians(sigma)
        s2 = sigma if self.change == "sigma for variance" else sigma * sigma
        low, wide = (0.09, 0.33) if self.change == "constants exchanged" else (0.33, 0.09)
        A = 1.0 - 0.5 * s2 / (s2 + low)
        B = 0.45 * s2 / (s2 + wide)
        alpha, beta = np.maximum(to, ti), np.minimum(to, ti)
        if self.change == "min and max":
            alpha, beta = beta, alpha
        cosine = np.cos(pi - po)
        if self.change == "cosine of directions":
            cosine = np.sum(o * i, axis=1)
        if self.change != "no max":
            cosine = np.maximum(cosine, 0.0)
        f = self.albedo / math.pi * (A + B * cosine * np.sin(alpha) * np.tan(beta))
        if self.change == "no pi":
            f = f * math.pi
        if self.change == "cosine twice":
            f = f * i[:, 2]
        if self.change == "albedo squared":
            f = f * self.albedo
        if self.change == "sine of alpha squared":
            f = self.albedo / math.pi * (A + B * cosine * np.sin(alpha) ** 2 * np.tan(beta))
        return np.repeat(f[:, None], 3, axis=1)


@dataclass
class Conductor:
    """Equations 4 to 11 of the sheet, silver."""

    ndf: str = "ggx"
    alpha: float = 0.25
    eta: tuple[float, ...] = (0.15494, 0.11648, 0.13809)
    k: tuple[float, ...] = (4.8181, 3.11562, 2.1424)
    change: str = ""

    def D(self, cosine: np.ndarray) -> np.ndarray:
        a = self.alpha**2 if self.change == "alpha squared" else self.alpha
        t2 = np.tan(np.arccos(np.clip(cosine, 0.0, 1.0))) ** 2
        power = 2 if self.change == "cos^2 in D" else 4
        if self.ndf == "beckmann":
            inner = t2 / a if self.change == "alpha in the exponent" else t2 / a**2
            return np.exp(-inner) / (math.pi * a**2 * cosine**power)
        bracket = (a**2 + t2) if self.change == "bracket not squared" else (a**2 + t2) ** 2
        return a**2 / (math.pi * cosine**power * bracket)

    def G1(self, cosine: np.ndarray) -> np.ndarray:
        tangent = np.tan(np.arccos(np.clip(cosine, 0.0, 1.0)))
        a = self.alpha
        if self.change == "k of the homework":
            k = (math.sqrt(a) + 1.0) ** 2 / 8.0
            return cosine / (cosine * (1.0 - k) + k)
        if self.ndf == "beckmann":
            b = 1.0 / (a * tangent)
            fit = (3.535 * b + 2.181 * b * b) / (1.0 + 2.276 * b + 2.577 * b * b)
            return np.where(b < 1.6, fit, 1.0)
        return 2.0 / (1.0 + np.sqrt(1.0 + a * a * tangent * tangent))

    def F(self, cosine: np.ndarray) -> np.ndarray:
        eta, k = np.array(self.eta), np.array(self.k)
        if self.change == "k forgotten":
            k = 0.0 * k
        R0 = ((eta - 1.0) ** 2 + k**2) / ((eta + 1.0) ** 2 + k**2)
        power = 4 if self.change == "power 4" else 5
        return R0 + (1.0 - R0) * (1.0 - cosine)[:, None] ** power

    def __call__(self, o: np.ndarray, i: np.ndarray) -> np.ndarray:
        h = o + i
        if self.change == "h not normalized":
            h = 0.5 * h
        else:
            h = h / np.linalg.norm(h, axis=1, keepdims=True)
        no, ni, nh, oh = o[:, 2], i[:, 2], h[:, 2], np.sum(o * h, axis=1)
        G = self.G1(no) * self.G1(ni)
        if self.change == "micro normal":
            G = self.G1(oh) ** 2
        if self.change == "one G1":
            G = self.G1(no)
        if self.change == "no G":
            G = np.ones_like(no)
        F = self.F(no if self.change == "F at n.o" else oh)
        if self.change == "no F":
            F = np.ones_like(F)
        below = {"no 4": no * ni, "pi for 4": math.pi * no * ni, "no n.i": 4.0 * no}.get(self.change, 4.0 * no * ni)
        f = F * (self.D(nh) * G / below)[:, None]
        if self.change == "clamped":
            f = np.minimum(f, 1.0)
        return f


@dataclass
class Phong:
    """Equation 1 of the sheet without the ambient term: L per unit of light."""

    kd: float = 0.5
    ks: float = 0.3
    p: float = 32.0
    change: str = ""

    def __call__(self, o: np.ndarray, i: np.ndarray) -> np.ndarray:
        n = np.array([0.0, 0.0, 1.0])
        r = 2.0 * i[:, 2:] * n - i
        cosine = np.sum(o * r, axis=1)
        if self.change == "half vector":
            h = o + i
            cosine = (h / np.linalg.norm(h, axis=1, keepdims=True))[:, 2]
        cosine = np.abs(cosine) if self.change == "no max" else np.maximum(cosine, 0.0)
        specular = self.ks * cosine**self.p
        kd = self.kd / math.pi if self.change == "kd over pi" else self.kd
        if self.change == "normalized":
            specular = specular * (self.p + 2.0) / (2.0 * math.pi)
        if self.change == "specular cosine":
            specular = specular * i[:, 2]
        L = kd * i[:, 2] + specular
        return np.repeat(L[:, None], 3, axis=1)


# --------------------------------------------------------------------------- homework 4


def hammersley(count: int) -> np.ndarray:
    index = np.arange(count)
    reverse = sum(((index >> bit) & 1) * 0.5 ** (bit + 1) for bit in range(16))
    return np.stack([index / count, reverse], axis=1)


@dataclass
class Table:
    """Bonus 1: E by importance sampling of the normals, or E by cosine-weighted directions; as the file holds it."""

    size: int = 32
    k: str = "figure"
    change: str = ""
    cosine: bool = False
    samples: int = 1024
    flip: bool = True
    rng: np.random.Generator | None = None  # random directions, others for each texel
    extra: dict[str, Any] = field(default_factory=dict)

    def k_of(self, roughness: np.ndarray) -> np.ndarray:
        return {
            "figure": roughness**2 / 2.0,
            "text": (roughness + 1.0) ** 2 / 8.0,
            "roughness / 2": roughness / 2.0,
            "(alpha + 1)^2 / 8": (roughness**2 + 1.0) ** 2 / 8.0,
        }[self.k]

    def E(self) -> np.ndarray:
        """(roughness, mu)."""
        at = (np.arange(self.size) + 0.5) / self.size
        rows = [self._row(roughness, at) for roughness in at]
        return np.array(rows)

    def _row(self, roughness: float, mu: np.ndarray) -> np.ndarray:
        alpha = roughness if self.change == "alpha = roughness" else roughness**2
        k = self.k_of(np.asarray(roughness))
        v = np.stack([np.sqrt(1.0 - mu**2), 0.0 * mu, mu], axis=1)[:, None]
        x = hammersley(self.samples)[None]
        if self.rng is not None:
            x = self.rng.random((len(mu), self.samples, 2))
        phi = 2.0 * math.pi * x[..., 1]
        if self.cosine:
            theta = 0.5 * np.arccos(1.0 - 2.0 * (x[..., 0] + (0.5 / self.samples if self.rng is None else 0.0)))
        else:
            theta = np.arctan(alpha * np.sqrt(x[..., 0]) / np.sqrt(1.0 - x[..., 0]))
        w = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=2)
        if self.cosine:
            light, m = w, (v + w) / np.linalg.norm(v + w, axis=2, keepdims=True)
        else:
            m = w
            light = 2.0 * np.sum(v * m, axis=2, keepdims=True) * m - v
        nl, nm, vm, nv = light[..., 2], m[..., 2], np.sum(v * m, axis=2), mu[:, None]
        lit = nl > 0.0
        nl = np.where(lit, nl, 1.0)
        G = nl / (nl * (1.0 - k) + k) * (nv / (nv * (1.0 - k) + k))
        if self.change == "no G":
            G = np.ones_like(G)
        if self.change == "one G":
            G = nv / (nv * (1.0 - k) + k) + 0.0 * nl
        if self.cosine:
            D = alpha**2 / np.maximum(math.pi * (nm**2 * (alpha**2 - 1.0) + 1.0) ** 2, 1e-4)
            weight = D * G * math.pi / (4.0 * nv * nl)
        else:
            weight = vm * G / (nv * nm)
        if self.change == "cosine twice":
            weight = weight * nl
        if self.change == "no cosine":
            weight = weight / nl
        if self.change == "no n.m":
            weight = weight * nm
        if self.change == "no jacobian":
            weight = weight / (4.0 * vm)
        return np.mean(np.where(lit, weight, 0.0), axis=1)

    def picture(self) -> np.ndarray:
        """(size, size) of bytes, row 0 on top."""
        E = self.E()
        E = {"times 2": 2.0 * E, "over pi": E / math.pi}.get(self.change, E)
        E = 1.0 - E if self.change == "1 - E" else E
        E = E[:, ::-1] if self.change == "mu to the left" else E
        E = E.T if self.change == "transposed" else E
        return _bytes(E[::-1] if self.flip else E)


@dataclass
class Average:
    """E_avg from one's own E, stored along rows."""

    weight: Callable[[np.ndarray], np.ndarray] = lambda mu: 2.0 * mu
    table: Table = field(default_factory=Table)

    def picture(self) -> np.ndarray:
        E = self.table.E()
        mu = (np.arange(E.shape[1]) + 0.5) / E.shape[1]
        value = np.mean(E * self.weight(mu), axis=1)
        return _bytes(np.repeat(value[:, None], E.shape[1], axis=1)[::-1])


def _bytes(value: np.ndarray) -> np.ndarray:
    return np.clip(np.floor(value * 255.0), 0.0, 255.0).astype(np.uint8)
