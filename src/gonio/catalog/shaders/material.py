"""A shader as a material, with the shader's eval, and with its pdf and sample if it has both."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from ... import ops
from ...material import binding, tree
from ...material.bsdf import BSDF, StatedAlbedo
from ...material.calling import method
from ...material.sample import Sample
from ...ops import Direction, Mode, Scalar, Spectrum, backend
from ...ops.types import Value
from ...spirv.values import leaves, numeric, truth, where
from .declared import INTEGERS

if TYPE_CHECKING:
    from .program import Program

ROTATIONS = 64  # number of directions at which isotropy is tested
_SIZES = {"spectrum": (3,), "alpha": (2,)}  # shapes of parameters that are vectors
ISOTROPIC = 1e-9  # largest relative change under rotation of an isotropic shader, in double precision


class _ShaderFile(BSDF):
    """The BRDF of a shader, sampled with a guide.

    program  the shader, with the meanings of its functions
    inside   the folder that must contain the files of the shader; None allows any folder
    fields   fields of each parameter, one per component of vectors that are not colors
    """

    program: ClassVar[Program]
    inside: ClassVar[Path | None] = None
    fields: ClassVar[dict[str, tuple[str, ...]]] = {}
    only_rgb: ClassVar[bool] = True
    fits_factors: ClassVar[bool] = True  # a default of 1 need not be a scale factor: clearcoatGloss

    @property
    def transmits(self) -> bool:
        return self.program.adapter.transmits

    @property
    def isotropic(self) -> bool:
        """Whether values are invariant under rotations about the normal, which is tested at some directions."""
        plain = self.plain
        cached = vars(plain).get("_isotropic")
        if cached is None:
            cached = _is_isotropic(plain)
            vars(plain)["_isotropic"] = cached
        return bool(cached)

    def _values(self) -> dict[str, Value]:
        values: dict[str, Value] = {}
        for name, declared in self.program.parameters.items():
            given = [getattr(self, field) for field in self.fields.get(name, ())]
            if declared.uniform.kind == "fixed":
                values[name] = declared.uniform.default
            elif declared.uniform.kind == "angle":  # no rotation if it is the number 0
                values[name] = (1.0, 0.0) if given[0] is None else (given[0].x, given[0].y)
            elif declared.uniform.kind == "alpha":
                values[name] = given[0].x, given[0].y
            elif declared.shape == "vec3":
                values[name] = tuple(ops.channels(given[0]))
            elif declared.shape in INTEGERS:
                values[name] = int(given[0])
            else:
                values[name] = given[0] if len(given) == 1 else tuple(given)
        return values

    def _run(self, formula: str, wo: Direction, **others: Direction) -> Value:
        directions = {"view": (wo.x, wo.y, wo.z), **{name: (v.x, v.y, v.z) for name, v in others.items()}}
        return self.program.run(formula, self._values(), directions)

    def _above(self, wo: Direction, wi: Direction) -> Value:
        if self.program.adapter.struct:  # a shader written by Gonio is 0 where it should be
            return True
        if self.program.adapter.transmits:
            return (wo.z != 0.0) & (wi.z != 0.0)
        return (wo.z > 0.0) & (wi.z > 0.0)

    def stated_albedo(self, wo: NDArray[np.float64]) -> StatedAlbedo | None:
        """The albedo that the shader's own function returns, if the adapter names one."""
        adapter = self.program.adapter
        if not adapter.albedo:
            return None
        types = backend.types("float64")
        bound = binding.bind_to(self, types)
        color = self.program.color(bound._run("albedo", backend.vector_of(wo, 3, types)))
        channels = [np.broadcast_to(np.asarray(channel, float), len(wo)) for channel in color]
        return StatedAlbedo(adapter.albedo, np.stack(channels, axis=-1), adapter.albedo_tolerance)

    @method
    def eval(self, wo: Direction, wi: Direction, mode: Mode = "radiance") -> Spectrum:
        """The value of the shader's function, multiplied by |cos theta_i| unless the function includes this factor."""
        factor = 1.0 if self.program.adapter.cosine else ops.abs(wi.z)
        above = self._above(wo, wi)
        color = self.program.color(self._run("eval", wo, light=wi))
        channels = [where(above, channel * factor, 0.0) for channel in color]
        return ops.vec3(*channels)  # type: ignore[return-value]  # three numbers in all variants


class _SampledShaderFile(_ShaderFile):
    """The BRDF of a shader with its own pdf and sample functions."""

    @method
    def pdf(self, wo: Direction, wi: Direction) -> Scalar:
        """The density that the shader's pdf function returns."""
        density = numeric(leaves(self._run("pdf", wo, light=wi))[0])
        return where(self._above(wo, wi), density, 0.0)  # type: ignore[no-any-return]

    @method
    def sample(self, wo: Direction, u: Direction, mode: Mode = "radiance") -> Sample:
        """The direction that the shader's sample function returns. The weight is the shader's, or else eval / pdf."""
        drawn = self._run("sample", wo, u=u)
        members = dict(zip(self.program.members("sample"), drawn, strict=False))
        direction = next((members[name] for name in ("wi", "direction", "L", "l", "dir") if name in members), drawn)
        wi: Value = ops.vec3(*[numeric(part) for part in leaves(direction)[:3]])
        if "weight" not in members or "pdf" not in members:
            return self._weighted(wi=wi, wo=wo, mode=mode)
        above = self._above(wo, wi)  # as in eval and pdf, a direction below the surface is a failed sample
        weight: Value = ops.vec3(*[where(above, numeric(part), 0.0) for part in leaves(members["weight"])])
        made = Sample.of_density(wi, weight, where(above, numeric(members["pdf"]), 0.0))
        delta, eta = truth(members.get("delta", False)), numeric(members.get("eta", 1.0))
        return made._replace(
            delta=delta if not isinstance(delta, bool) else made.delta,
            eta=eta if not isinstance(eta, float) else made.eta * eta,
        )


def _is_isotropic(material: _ShaderFile) -> bool:
    random = np.random.default_rng(1)

    def directions() -> Any:
        z, phi = random.uniform(0.05, 1.0, ROTATIONS), random.uniform(0.0, 2.0 * np.pi, ROTATIONS)
        r = np.sqrt(1.0 - z * z)
        return np.stack([r * np.cos(phi), r * np.sin(phi), z])

    wo, wi, turn = directions(), directions(), random.uniform(0.3, 6.0, ROTATIONS)
    graph = material.record("eval")
    given: dict[str, Any] = {}
    for leaf in tree.leaves(material):
        if leaf.parameter.numeric:
            value = np.asarray(leaf.value, float)
            value = value if value.ndim < 2 else value[0]
            kind = leaf.parameter.kind
            if kind == "angle":
                value = np.stack([np.cos(value), np.sin(value)])
            given[f"self_{leaf.path}"] = np.broadcast_to(value, _SIZES[kind]) if kind in _SIZES else value

    def values(by: Any) -> Any:
        c, s = np.cos(by), np.sin(by)
        rotated = [np.stack([c * v[0] - s * v[1], s * v[0] + c * v[1], v[2]]) for v in (wo, wi)]
        every = {name: value[:, None] if np.ndim(value) else value for name, value in given.items()}
        return np.asarray(graph.evaluate(wo=rotated[0], wi=rotated[1], **every))

    first, second = values(0.0 * turn), values(turn)
    size = np.maximum(np.abs(first), np.abs(second))
    same = np.abs(first - second) <= ISOTROPIC * size + 1e-12
    return bool(np.all(same | ~np.isfinite(size)))
