"""The scene format: the keys of the lab's JSON and Gonio's additions.

These classes define the format: `gonio schema` exports what they accept, with their docstrings as descriptions. Aliases
give the keys their spelling in the file.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from pydantic import AfterValidator, ConfigDict, Field, PrivateAttr, ValidationInfo, model_validator
from pydantic.json_schema import models_json_schema

from ..bridge.types import Json
from ..errors import InputError, did_you_mean
from ..members import Family
from ..pictures.images import SUFFIXES
from .files import located
from .film_size import check_film
from .materials import BY_TYPE, PLACEHOLDER, Material, any_material
from .values import Light, NonNegative, Number, Part, Positive, Radiance, Sky, Vector, Whole, invalid

if TYPE_CHECKING:
    from ..transport import integrators as program

MAX_SAMPLES = 2**30  # samples per pixel, which can still be counted in 32 bits


class Output(Part):
    """The file to which the picture is written."""

    filename: str = Field(min_length=1)
    """A name that ends in .hdr, .png, .exr or .npz; with `-o FILE`, any name is accepted. Row 0 is the top row."""

    @model_validator(mode="after")
    def _known_format(self, info: ValidationInfo) -> Output:
        named = (info.context or {}).get("names_output", True)
        if named and Path(self.filename).suffix.lower() not in SUFFIXES:
            hint = f"end it in {', '.join(SUFFIXES)}, or give -o FILE"
            raise invalid(f"'{self.filename}' is not a known kind of picture", hint, "filename")
        return self


class Sampler(Part):
    """The number of samples per pixel, and the random numbers. Give `samples`, or both `xSamples` and `ySamples`."""

    type: str = "independent"
    """Name of the random-number sampler. The value used in Lab 2, "independent", selects the default sampler."""
    x_samples: Whole | None = Field(None, alias="xSamples", ge=1, le=MAX_SAMPLES)
    """Samples per pixel = xSamples * ySamples."""
    y_samples: Whole | None = Field(None, alias="ySamples", ge=1, le=MAX_SAMPLES)
    """Samples per pixel = xSamples * ySamples."""
    samples: Whole | None = Field(None, ge=1, le=MAX_SAMPLES)
    """Samples per pixel, in place of `xSamples` and `ySamples`."""
    seed: Whole | None = Field(None, ge=0, lt=2**32)
    """Seed of the random numbers. The same seed gives a bit-identical picture."""

    @model_validator(mode="after")
    def _counts(self) -> Sampler:
        pair = (self.x_samples, self.y_samples)
        if self.samples is not None and pair != (None, None):
            raise invalid("both 'samples' and 'xSamples'/'ySamples' are given", "keep one form", "samples")
        if self.samples is None and None in pair:
            key = "xSamples" if self.x_samples is None else "ySamples"
            raise invalid(f"key '{key}' is missing", "give xSamples and ySamples, or samples")
        if self.spp > MAX_SAMPLES:
            raise invalid(f"{self.spp} samples per pixel is too many", f"up to {MAX_SAMPLES}", "xSamples")
        return self

    @model_validator(mode="after")
    def _known_type(self) -> Sampler:
        if self.type not in ("independent", "default"):
            from ..transport.sampler import SAMPLERS

            if self.type not in SAMPLERS:
                raise invalid(f"unknown sampler '{self.type}'", did_you_mean(self.type, list(SAMPLERS)), "type")
        return self

    @property
    def spp(self) -> int:
        return self.samples or (self.x_samples or 1) * (self.y_samples or 1)

    @property
    def preference(self) -> str:
        """The requested sampler; "default" if the file expresses no preference."""
        return "default" if self.type == "independent" else self.type


class CameraTransform(Part):
    """Position and orientation of the camera. The cross product forward x up points to the right in the picture."""

    position: Vector
    """Position of the camera."""
    look_at: Vector = Field(alias="lookAt")
    """The point at the center of the picture."""
    up: Vector
    """The direction that points up in the picture; it need not be perpendicular to the viewing direction."""

    @model_validator(mode="after")
    def _spans_a_frame(self) -> CameraTransform:
        forward = np.subtract(self.look_at, self.position)
        distance, height = np.linalg.norm(forward), np.linalg.norm(self.up)
        # 32-bit coordinates carry 24 bits: below this distance, the direction consists of rounding errors.
        if distance <= 2**-22 * max(1e-30, np.abs(self.position).max(), np.abs(self.look_at).max()):
            raise invalid("position and lookAt are the same point", "move one of them", "lookAt")
        if height == 0:
            raise invalid("up has length 0", "give a direction, e.g. [0, 1, 0]", "up")
        if np.linalg.norm(np.cross(forward / distance, np.divide(self.up, height))) < 1e-5:
            raise invalid("up is parallel to the view", "tilt one of them, so that the up direction is defined", "up")
        return self


class Film(Part):
    """The size of the picture."""

    size: tuple[Whole, Whole]
    """[width, height] in pixels."""

    @model_validator(mode="before")
    @classmethod
    def _two_numbers(cls, data: object) -> object:
        size = data.get("size") if isinstance(data, dict) else None
        if size is not None and not (isinstance(size, (list, tuple)) and len(size) == 2):
            raise invalid("expected 2 numbers [width, height]", "give [width, height]", "size")
        return data

    @model_validator(mode="after")
    def _fits(self) -> Film:
        try:
            check_film(self.size, "size")  # the same limit as `--size`
        except InputError as error:
            raise invalid(error.what, error.hint, "size") from None
        return self


class Camera(Part):
    """A pinhole camera that looks along its -z axis."""

    type: Literal["pinhole"] = "pinhole"
    transform: CameraTransform
    """Position and orientation of the camera."""
    vertical_fov: Number = Field(alias="verticalFov", gt=0, lt=180)
    """Vertical field of view, in degrees."""
    film: Film
    """The size of the picture."""
    t_near: Positive = Field(1e-4, alias="tNear")
    """Near clipping distance."""
    t_far: Positive = Field(1e10, alias="tFar")
    """Far clipping distance."""
    polarizer: Number | None = None
    """Direction of polarization that is transmitted by an ideal linear polarizer in front of the lens, in degrees
    counterclockwise from the picture's horizontal. The polarizer absorbs half of the power of unpolarized light. A
    scene with this key is rendered by Mitsuba's path tracer in a polarized variant.
    """
    time_start: Number = Field(0.0, alias="timeStart")
    """No effect: scenes are static."""
    time_end: Number = Field(0.0, alias="timeEnd")
    """No effect: scenes are static."""

    @model_validator(mode="after")
    def _depth_range(self) -> Camera:
        if self.t_far <= self.t_near:
            raise invalid(f"tFar {self.t_far:g} is not beyond tNear {self.t_near:g}", "swap or widen them", "tFar")
        return self


def integrators() -> Family[type[program.Integrator]]:
    """The integrators, including those of other packages."""
    from ..transport.integrators import Integrator

    return Integrator.family


def _list_integrators(schema: dict[str, Any]) -> None:
    """Add the names of integrators to the JSON Schema, each with its title, and which of them need a depth."""
    family = integrators()
    names = [{"const": name, "description": title} for name, title in family.titles().items()]
    schema["properties"]["type"] = {"oneOf": names, "title": "Type"}
    deep = {"properties": {"type": {"enum": [name for name, member in family.all().items() if member.takes_depth]}}}
    schema |= {"if": deep, "then": {"required": ["maxDepth"]}, "else": {"properties": {"maxDepth": False}}}


class Integrator(Part):
    """The integrator, which determines the quantity that the picture shows."""

    model_config = ConfigDict(json_schema_extra=_list_integrators)

    type: str
    max_depth: Whole | None = Field(None, alias="maxDepth", ge=1, le=100_000)
    """Maximum path length in segments: N allows N - 1 shaded vertices; 1 shows only lights, 2 adds direct light."""

    @model_validator(mode="after")
    def _known_type(self) -> Integrator:
        known = integrators().all()
        if self.type not in known:
            raise invalid(f"unknown type '{self.type}'", did_you_mean(self.type, list(known)), "type")
        if known[self.type].takes_depth and self.max_depth is None:
            raise invalid("key 'maxDepth' is missing", 'add "maxDepth"')
        if self.max_depth is not None and not known[self.type].takes_depth:
            raise invalid(f"'{self.type}' takes no maxDepth", "remove it, or use path", "maxDepth")
        return self


class Rotation(Part):
    """A rotation about an axis through the origin, counterclockwise as seen from the tip of the axis."""

    axis: Vector
    """Direction of the axis; its length has no effect."""
    radian: Number
    """Angle of the rotation, in radians."""

    @model_validator(mode="after")
    def _has_an_axis(self) -> Rotation:
        if not any(self.axis):
            raise invalid("axis has length 0", "give a direction, e.g. [0, 1, 0]", "axis")
        return self

    def matrix(self) -> np.ndarray:
        """The 3x3 rotation matrix, by Rodrigues' formula."""
        x, y, z = np.asarray(self.axis) / np.linalg.norm(self.axis)
        cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        return np.eye(3) + math.sin(self.radian) * cross + (1 - math.cos(self.radian)) * cross @ cross


class Transform(Part):
    """The shape is first scaled, then rotated, then translated: the matrix is translate * rotate * scale."""

    translate: Vector = (0.0, 0.0, 0.0)
    """Translation along x, y and z."""
    rotate: Rotation | None = None
    """Rotation about an axis through the origin."""
    scale: Vector = (1.0, 1.0, 1.0)
    """Scale factors along x, y and z."""

    @model_validator(mode="after")
    def _is_invertible(self) -> Transform:
        # Below this, a unit shape is smaller than what 32 bits resolve at a distance of 1, and its inverse overflows.
        if min(abs(s) for s in self.scale) < 1e-12:
            raise invalid(f"scale {list(self.scale)} flattens the shape", "use factors other than 0", "scale")
        return self

    def matrix(self) -> np.ndarray:
        matrix = np.eye(4)
        if self.rotate is not None:
            matrix[:3, :3] = self.rotate.matrix() @ np.diag(self.scale)
        elif self.scale != (1.0, 1.0, 1.0):
            np.fill_diagonal(matrix[:3, :3], self.scale)
        matrix[:3, 3] = self.translate
        return matrix


class ShapePart(Part):
    """The keys that all shapes share."""

    material: Material | None = None
    """Material of the shape; by default, `matte` with an albedo of 0.5."""
    transform: Transform = Transform()
    """Transformation of the shape."""


class Sphere(ShapePart):
    """A sphere, with texture coordinates u = atan2(x, z) / (2 pi) and v = (angle from +y) / pi."""

    type: Literal["sphere"]
    center: Vector
    """Center of the sphere."""
    radius: Positive
    """Radius of the sphere; `transform` does not scale it."""


class Parallelogram(ShapePart):
    """The points base + u edge0 + v edge1, where the texture coordinates u and v range from 0 to 1.

    The normal is normalize(edge0 x edge1).
    """

    type: Literal["parallelogram"]
    base: Vector
    """The corner with u = v = 0."""
    edge0: Vector
    """The edge along which u increases."""
    edge1: Vector
    """The edge along which v increases."""

    @model_validator(mode="after")
    def _has_an_area(self) -> Parallelogram:
        lengths = [float(np.linalg.norm(edge)) for edge in (self.edge0, self.edge1)]
        for key, length in zip(("edge0", "edge1"), lengths, strict=True):
            if length == 0:
                raise invalid(f"{key} has length 0", "give two edges that span an area", key)
        if np.linalg.norm(np.cross(self.edge0, self.edge1)) < 1e-6 * lengths[0] * lengths[1]:
            raise invalid("edge0 and edge1 are parallel", "give two edges that span an area", "edge1")
        return self


class Cube(ShapePart):
    """The cube [-1, 1]^3. On the faces normal to axis i, the texture coordinates u and v run along the axes i + 1 and
    i + 2 from -1 to 1.
    """

    type: Literal["cube"]


def _turn(value: float) -> float:
    if value > 2 * math.pi * (1 + 1e-3):  # tolerance for rounded values such as 6.2832
        raise invalid(f"phi_max {value:g} is more than a full turn", "give radians in (0, 2pi]")
    return min(value, 2 * math.pi)


Turn = Annotated[Positive, AfterValidator(_turn)]


class Disk(ShapePart):
    """A disk in the plane z = 0 with normal +z. The texture coordinate u is phi / phi_max, where phi is measured from
    +x toward +y; v is 0 at the rim and 1 at the center.
    """

    type: Literal["disk"]
    radius: Positive = 1.0
    """Radius of the disk."""
    inner_radius: NonNegative = 0.0
    """Radius of the hole in the center."""
    phi_max: Turn = 2 * math.pi
    """Angle of the sector about the z axis, in radians. The default is a full turn."""

    @model_validator(mode="after")
    def _has_an_area(self) -> Disk:
        if self.inner_radius >= self.radius * (1 - 1e-6):
            raise invalid(
                f"inner_radius {self.inner_radius:g} leaves nothing of radius {self.radius:g}",
                "make it smaller than radius",
                "inner_radius",
            )
        return self


class Cylinder(ShapePart):
    """A cylinder about the z axis from z = 0 to z = height, open at both ends.

    Its texture coordinates are u = phi / phi_max and v = z / height.
    """

    type: Literal["cylinder"]
    radius: Positive = 1.0
    """Radius of the cylinder."""
    height: Positive = 1.0
    """Height of the cylinder."""
    phi_max: Turn = 2 * math.pi
    """Angle of the sector about the z axis, in radians. The default is a full turn."""


class Cone(ShapePart):
    """A cone about the z axis with its base in the plane z = 0 and its apex at z = height, open at the base.

    Its texture coordinates are u = phi / phi_max and v = z / height.
    """

    type: Literal["cone"]
    radius: Positive = 1.0
    """Radius of the base."""
    height: Positive = 1.0
    """Distance from the base to the apex."""
    phi_max: Turn = 2 * math.pi
    """Angle of the sector about the z axis, in radians. The default is a full turn."""


class Mesh(ShapePart):
    """Triangles from an .obj or .ply file in the scene's folder. This type is called `triangle` in Lab 2."""

    type: Literal["triangle", "mesh"]
    file: str = Field(min_length=1)
    """The mesh file. Its texture coordinates are used unchanged, and v = 0 is the top of a texture. If the file
    contains no normals, the mesh is flat-shaded.
    """


Shape = Annotated[Sphere | Parallelogram | Cube | Disk | Cylinder | Cone | Mesh, Field(discriminator="type")]


class AreaLight(Part):
    """A shape that emits a constant radiance in all directions, from both sides."""

    type: Literal["areaLight"]
    energy: Radiance
    """Emitted radiance, W/(m^2 sr)."""
    shape: Shape
    """The shape that emits the light."""


class SpotLight(Part):
    """A point light with equal intensity in all directions; the name `spotLight` is that of Lab 2."""

    type: Literal["spotLight"]
    position: Vector
    """Position of the light."""
    energy: Radiance
    """Intensity, W/sr."""


class DirectionalLight(Part):
    """Parallel light from infinity, as from a point-like sun."""

    type: Literal["directionalLight"]
    direction: Vector
    """The direction in which the light travels; its length has no effect. [0, -1, 0] shines down."""
    energy: Radiance
    """Irradiance on a surface perpendicular to the light, W/m^2."""

    @model_validator(mode="after")
    def _has_a_direction(self) -> DirectionalLight:
        if not any(self.direction):
            raise invalid("direction has length 0", "give the direction of the light, e.g. [0, -1, 0]", "direction")
        return self

    def unit(self) -> np.ndarray:
        """The normalized direction."""
        scaled = np.divide(self.direction, np.abs(self.direction).max())  # squares of small numbers underflow
        return scaled / np.linalg.norm(scaled)


class EnvironmentLight(Part):
    """Light from infinitely far away, in all directions.

    The direction (sin t sin p, cos t, sin t cos p) has the texture coordinates u = p / (2 pi) and v = t / pi.
    """

    type: Literal["environmentLight"]
    texture: Sky | None = None
    """Radiance: an image, [r, g, b] or a number (gray)."""
    radiance: Radiance | None = None
    """The same radiance in all directions, in place of `texture`."""

    @model_validator(mode="after")
    def _one_source(self) -> EnvironmentLight:
        if (self.texture is None) == (self.radiance is None):
            what = "key 'texture' is missing" if self.texture is None else "both 'texture' and 'radiance' are given"
            raise invalid(what, "give one of texture, radiance")
        return self


LightSource = Annotated[AreaLight | SpotLight | DirectionalLight | EnvironmentLight, Field(discriminator="type")]


class Contents(Part):
    """The shapes and lights of the scene."""

    acceleration: Literal["embree", "linear", "bvh", "octree"] = "embree"
    """No effect: Gonio uses Mitsuba's acceleration structure, or none if the scene has only a few simple shapes."""
    shapes: list[Shape] = Field(default_factory=list)
    """The shapes."""
    lights: list[LightSource] = Field(default_factory=list)
    """The lights, with at most one `environmentLight`."""
    ambient: Light | None = None
    """Radiance of the ambient light, Ia in eq. 1 of the Lab 2 sheet. It affects only materials that have a `ka`."""

    @model_validator(mode="after")
    def _one_environment(self) -> Contents:
        if sum(isinstance(light, EnvironmentLight) for light in self.lights) > 1:
            raise invalid("more than one environmentLight", "keep one", "lights")
        return self


class SceneDescription(Part):
    """A scene in Lab 2's JSON format, with Gonio's additions."""

    json_schema: str | None = Field(None, alias="$schema")
    """URL of the JSON Schema, for editors."""
    output: Output
    """The file to which the picture is written."""
    sampler: Sampler
    """The number of samples per pixel, and the random numbers."""
    camera: Camera
    """The camera."""
    integrator: Integrator
    """The integrator."""
    contents: Contents = Field(alias="scene")
    """The shapes and lights."""
    top_ambient: Light | None = Field(None, alias="ambient")
    """Alternative position of the key `scene.ambient`."""

    _path: Path = PrivateAttr(default=Path("scene.json"))
    _allow_outside: bool = PrivateAttr(default=False)
    _warnings: list[str] = PrivateAttr(default_factory=list)
    _raw: dict[str, Json] = PrivateAttr(default_factory=dict)

    @model_validator(mode="after")
    def _one_ambient(self) -> SceneDescription:
        if self.top_ambient is not None and self.contents.ambient is not None:
            raise invalid("both 'ambient' and 'scene.ambient' are given", "keep one", "ambient")
        return self

    @property
    def spp(self) -> int:
        """Samples per pixel."""
        return self.sampler.spp

    @property
    def seed(self) -> int | None:
        return self.sampler.seed

    @property
    def ambient(self) -> tuple[float, float, float] | None:
        return self.top_ambient or self.contents.ambient

    @property
    def shapes(self) -> list[Shape]:
        return self.contents.shapes

    @property
    def lights(self) -> list[LightSource]:
        return self.contents.lights

    @property
    def path(self) -> Path:
        """The scene file."""
        return self._path

    @property
    def folder(self) -> Path:
        """The folder that contains the scene's files."""
        return self._path.parent

    @property
    def warnings(self) -> list[str]:
        """Warnings about suspicious but usable values, each with its location in the file."""
        return list(self._warnings)

    @property
    def raw(self) -> dict[str, Json]:
        """The file's JSON with overrides applied, as plain values."""
        return self._raw

    def where(self, pointer: str) -> str:
        """A location in this scene's file, for messages."""
        return f"{self._path}#{pointer}"

    def locate(self, file: str, pointer: str) -> Path:
        """The path of a file to which the scene refers. Raises InputError if it is missing or outside the folder."""
        return located(file, self.folder, self.where(pointer), self._allow_outside)


MATERIAL = "#/$defs/AnyMaterial"


def json_schema() -> dict[str, Any]:
    """The format as a JSON Schema (draft 2020-12), for editors and other checkers."""
    parts = dict.fromkeys(BY_TYPE.values())
    wanted: list[tuple[Any, Literal["validation"]]] = [(part, "validation") for part in (SceneDescription, *parts)]
    references, pool = models_json_schema(wanted, by_alias=True)
    definitions = pool["$defs"]
    schema = definitions.pop(references[SceneDescription, "validation"]["$ref"].rpartition("/")[2])
    material = any_material(references[part, "validation"] for part in parts)
    schema["$defs"] = {**definitions, MATERIAL.rpartition("/")[2]: material}
    schema = _finished(schema)
    schema["$schema"] = "https://json-schema.org/draft/2020-12/schema"
    schema["title"] = "Gonio scene"
    return schema


def _finished(schema: Any) -> Any:
    """The schema without `null`, which denotes an absent key here and is rejected in files, and with references to
    materials in place of `PLACEHOLDER`."""
    if isinstance(schema, list):
        return [_finished(item) for item in schema]
    if not isinstance(schema, dict):
        return schema
    if PLACEHOLDER.items() <= schema.items():
        schema = {**{key: item for key, item in schema.items() if key not in PLACEHOLDER}, "$ref": MATERIAL}
    options = [item for item in schema.get("anyOf", ()) if item != {"type": "null"}]
    if options:
        rest = {key: item for key, item in schema.items() if key != "anyOf"}
        schema = rest | (options[0] if len(options) == 1 else {"anyOf": options})
    return {key: _finished(item) for key, item in schema.items() if not (key == "default" and item is None)}
