"""Compute Mitsuba's direction samples toward lamps from points on the lamps and their densities."""

from __future__ import annotations

from types import ModuleType

import drjit as dr

from ...bridge.types import DirectionSample, Float, Interaction, Mask, Point, PositionSample, Record, Shape
from .solid_angles import LampView


def direction_sample(mi: ModuleType, view: LampView, sample: Point, it: Interaction) -> DirectionSample:
    """A direction sample from `it` toward a lamp, with two random numbers in [0, 1)."""
    ps = dr.zeros(mi.PositionSample3f, dr.width(it.p))
    point, normal, uv, pdf = view.sample(sample.x, sample.y)
    ps.p, ps.n, ps.uv, ps.time = point, mi.Normal3f(normal), mi.Point2f(*uv), it.time
    ds = toward(mi, ps, it)
    ds.pdf = pdf
    return ds


def area_sample(mi: ModuleType, ps: PositionSample, it: Interaction) -> DirectionSample:
    """The direction sample for a point sampled by area: pdf per steradian = pdf per area * r^2 / |cos|."""
    ds = toward(mi, ps, it)
    ds.pdf = per_steradian(ps.pdf, ds)
    return ds


def toward(mi: ModuleType, ps: Record, it: Interaction) -> DirectionSample:
    """The direction sample for a position sample, without the density."""
    ds = mi.DirectionSample3f(ps)
    away = ps.p - it.p
    ds.dist = dr.norm(away)
    ds.d = away / ds.dist
    ds.delta = mi.Bool(False)
    return ds


def area_density(shape: Shape, ps: PositionSample, active: Mask) -> Float:
    """The density per area with which a shape samples its points."""
    density: Float = shape.pdf_position(ps, active)
    return density


def per_steradian(pdf: Float, ds: DirectionSample) -> Float:
    """Convert a density per area to a density per solid angle."""
    cosine = dr.abs(dr.dot(ds.d, ds.n))
    return dr.select(cosine > 0, pdf * dr.square(ds.dist) / cosine, 0)
