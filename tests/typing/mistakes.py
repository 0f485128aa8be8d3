"""Mistakes that an editor must underline: each line that is one ends with the rule by which pyright reports it."""

# pyright: standard

from __future__ import annotations

import gonio as go
import numpy as np

gold = go.Conductor.preset("Au")
wo = np.array([[0.0, 0.0, 1.0]])

# materials
go.Lambert(albedoo=1)  # reportCallIssue
go.Lambert(0.5, 0.5)  # reportCallIssue
go.Lambert(albedo="red")  # reportArgumentType
go.Mix(gold)  # reportCallIssue
go.TwoSided(0.5)  # reportArgumentType
go.Conductor(ndf=3)  # reportArgumentType
go.Conduktor()  # reportAttributeAccessIssue
gold.alpha = 0.3  # reportAttributeAccessIssue
gold.ndf = "ggx"  # reportAttributeAccessIssue
print(gold.colour)  # reportAttributeAccessIssue

# calls
gold.eval(wo)  # reportCallIssue
gold.eval(wo, wo, mode="light")  # reportCallIssue, reportArgumentType
gold.pdf(wo, wo, precision="float16")  # reportCallIssue, reportArgumentType
gold.pdf(wo, wo, "radiance")  # reportCallIssue
print(gold.eval(wo, wo).wi)  # reportAttributeAccessIssue
print(gold.sample(wo, wo).density)  # reportAttributeAccessIssue
wide: go.Dielectric = go.Conductor.preset("Au")  # reportAssignmentType
values: list[float] = gold.eval(wo, wo)  # reportAssignmentType
go.set_precision("single")  # reportArgumentType

# verbs
go.render("scene", samples=4)  # reportCallIssue
go.render("scene", exposure="dark")  # reportArgumentType
go.render("scene", size=256)  # reportArgumentType
print(go.render("scene").passed)  # reportAttributeAccessIssue
go.verify(gold, fast=True)  # reportCallIssue
go.verify(3)  # reportArgumentType
print(go.verify(gold).failed)  # reportAttributeAccessIssue
go.emit(gold, language="glsl")  # reportCallIssue
go.plot(gold, kinds="slice")  # reportCallIssue
go.bake("ggx", texels=64)  # reportCallIssue
go.study("scene", ["alpha"])  # reportArgumentType
go.compare("a.exr")  # reportCallIssue
go.view(gold, width=400)  # reportCallIssue
go.albedo(3)  # reportArgumentType
go.model(gold)  # reportArgumentType


class Flat(go.BSDF):
    """Formulas with wrong kinds of values."""

    albedo: go.Colour = go.spectrum(0.5, "share")
    width: go.Number = go.spectrum(0.5, "a colour")  # reportAssignmentType
    shiny: bool = go.choice("no", "a name", {"no": "", "yes": ""})  # reportAssignmentType

    @go.method
    def eval(self, wo: go.Direction, wi: go.Direction, mode: go.Mode = "radiance") -> go.Spectrum:
        return wo.z  # reportReturnType

    @go.method
    def pdf(self, wo: go.Direction, wi: go.Direction) -> go.Scalar:
        return self.albedo  # reportReturnType

    @go.method
    def sample(self, wo: go.Direction, u: go.Direction, mode: go.Mode = "radiance") -> go.Sample:
        return self.sample_cosine(wo, u, mode)
