"""Elementary values of a scene: numbers, vectors, colors, textures, and the base class of all its objects."""

from __future__ import annotations

import ast
import functools
import inspect
import re
import sys
from collections.abc import Mapping
from itertools import pairwise
from types import ModuleType
from typing import Annotated, ClassVar, Literal

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    GetJsonSchemaHandler,
    Strict,
    Tag,
    model_validator,
)
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, PydanticCustomError

from .text import kind_of

VISIBLE = (380.0, 780.0)  # nm
MAX_NUMBER = 1e18  # its square fits into a 32-bit float, so that lengths of vectors stay finite


def invalid(what: str, hint: str, key: str = "") -> PydanticCustomError:
    """An error for a validator to raise; `key` is the key to which the error refers."""
    # Braces would be interpreted as placeholders, so the text is passed as the value of a placeholder.
    return PydanticCustomError("scene", "{what}", {"what": what, "hint": hint, "key": key})


class Part(BaseModel):
    """An object of the scene file: unknown keys are errors, values are not coerced, and instances are immutable."""

    model_config = ConfigDict(extra="forbid", frozen=True, protected_namespaces=(), hide_input_in_errors=True)
    article: ClassVar[str] = "this object"

    @model_validator(mode="before")
    @classmethod
    def _known_keys(cls, data: object) -> object:
        if isinstance(data, dict):
            known = cls.known_keys()
            for key in data:
                if key not in known:
                    raise PydanticCustomError(
                        "unknown_key", "unknown key", {"key": key, "known": known, "of": cls.describe(data)}
                    )
        return data

    @classmethod
    def __get_pydantic_json_schema__(cls, core: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        """The JSON Schema, with the docstrings of the fields as descriptions.

        Pydantic would read the docstrings from the source whenever a class is created, and creating the classes of a
        scene would take 1.5 times as long.
        """
        schema = handler(core)
        properties = handler.resolve_ref_schema(schema).get("properties", {})
        for name, text in _docstrings(cls).items():
            field = cls.model_fields.get(name)
            if field is not None and (field.alias or name) in properties:
                properties[field.alias or name].setdefault("description", text)
        return schema

    @classmethod
    def known_keys(cls) -> list[str]:
        """The keys of this object, as they are spelled in the file."""
        return [field.alias or name for name, field in cls.model_fields.items()]

    @classmethod
    def describe(cls, data: Mapping[str, object]) -> str:
        kind = data.get("type")
        return f"'{kind}'" if isinstance(kind, str) else re.sub("(?<=[a-z])(?=[A-Z])", " ", cls.__name__).lower()


def _docstrings(cls: type[Part]) -> dict[str, str]:
    """The docstrings of the fields of a class and of its base classes that are defined in a module."""
    texts: dict[str, str] = {}
    for base in reversed(cls.__mro__):
        module = sys.modules[base.__module__]
        if issubclass(base, Part) and getattr(module, base.__name__, None) is base:
            texts.update(_documented(module)[base.__name__])
    return texts


@functools.cache
def _documented(module: ModuleType) -> dict[str, dict[str, str]]:
    """The docstrings of all fields in a module, by class and field."""
    classes: dict[str, dict[str, str]] = {}
    for node in ast.parse(inspect.getsource(module)).body:
        if not isinstance(node, ast.ClassDef):
            continue
        texts = classes[node.name] = {}
        for line, below in pairwise(node.body):
            if not isinstance(line, ast.AnnAssign) or not isinstance(line.target, ast.Name):
                continue
            if isinstance(below, ast.Expr) and isinstance(below.value, ast.Constant):
                texts[line.target.id] = inspect.cleandoc(str(below.value.value))
    return classes


def _not_a_flag(value: object) -> object:
    if isinstance(value, bool):  # in Python, True is a number
        raise invalid(f"expected a number, got {kind_of(value)}", "give a number")
    return value


def _integer(value: object) -> object:
    # JSON does not distinguish 8 from 8.0
    return int(value) if isinstance(value, float) and value.is_integer() else _not_a_flag(value)


def _bounded(value: float) -> float:
    if abs(value) > MAX_NUMBER:
        raise invalid(
            f"{value:g} is too large", f"give at most {MAX_NUMBER:g}, so that its square fits 32-bit arithmetic"
        )
    return value


Number = Annotated[float, Strict(), BeforeValidator(_not_a_flag), AfterValidator(_bounded)]
Whole = Annotated[int, Strict(), BeforeValidator(_integer)]
Positive = Annotated[Number, Field(gt=0)]
NonNegative = Annotated[Number, Field(ge=0)]


def _of_length(count: int, names: str) -> BeforeValidator:
    def check(value: object) -> object:
        if not isinstance(value, (list, tuple)) or len(value) != count:
            raise invalid(f"expected {count} numbers {names}, got {kind_of(value)}", f"give {names}")
        return value

    return BeforeValidator(check)


Vector = Annotated[tuple[Number, Number, Number], _of_length(3, "[x, y, z]")]
Rgb = Annotated[tuple[Number, Number, Number], _of_length(3, "[r, g, b]")]
Light = Annotated[tuple[NonNegative, NonNegative, NonNegative], _of_length(3, "[r, g, b]")]


def _kind_of_value(value: object) -> str | None:
    if isinstance(value, bool):
        return None
    if isinstance(value, (int, float)):
        return "<number>"
    if isinstance(value, (list, tuple)):
        return "<list>"
    if isinstance(value, str):
        return "<name>"
    return "<texture>" if isinstance(value, (dict, Part)) else None


def _either(expected: str) -> Discriminator:
    """Distinguish numbers, lists and textures by the type of the value. Tags contain <>, so no tag equals a key."""
    return Discriminator(_kind_of_value, "expected", expected)


Factor = Annotated[
    Annotated[NonNegative, Tag("<number>")] | Annotated[Light, Tag("<list>")], _either("a number or [r, g, b]")
]


class ImageTexture(Part):
    """An image, mapped by the texture coordinates (u, v) of the surface; v = 0 is the top of the image. 8-bit values
    are divided by 255.
    """

    type: Literal["imageTex"]
    file: str = Field(min_length=1)
    """An image in the scene's folder: .png, .jpg, .hdr or .exr; FILE.glb#N is image number N of a glTF file."""
    color_space: Literal["raw", "srgb"] = Field("raw", alias="colorSpace")
    """"srgb" decodes 8-bit values to linear light; "raw" (Lab 2's default) leaves them unchanged."""
    filter: Literal["bilinear", "nearest"] = "bilinear"
    """Interpolation between texels."""
    wrap: Literal["repeat", "mirror", "clamp"] = "repeat"
    """Continuation of the image outside [0, 1]."""
    channel: Literal["r", "g", "b", "a"] | None = None
    """The channel to use as a gray value. Without this key, a scalar parameter uses the mean of red, green and blue."""
    factor: Factor = 1.0
    """Factor by which the values of the image are multiplied: one number, or one number per channel."""
    mean: Annotated[bool, Strict()] = False
    """Whether to use the mean of the image everywhere, for parameters that cannot vary over a surface."""


class NormalMap(Part):
    """An image of normals. A color c encodes the vector 2c - 1 in the frame of tangent (dp/du), bitangent
    (normal x tangent) and normal.
    """

    type: Literal["imageTex"] = "imageTex"
    file: str = Field(min_length=1)
    """An image in the scene's folder."""
    scale: Number = 1.0
    """Factor by which the slopes of the normals are multiplied."""


class BumpMap(Part):
    """An image of heights, mapped by the texture coordinates of the surface. A height is `scale` times the value of the
    image, from 0 to 1 (8-bit values are divided by 255).
    """

    type: Literal["imageTex"] = "imageTex"
    file: str = Field(min_length=1)
    """An image in the scene's folder."""
    scale: Number
    """Height for an image value of 1, in units of the scene."""


class LightSpectrum(Part):
    """The spectrum of a lamp: rendered as a color in RGB, and as a spectrum with `--spectral`."""

    scale: NonNegative = 1.0
    """Brightness: the luminance equals that of the radiance [scale, scale, scale]."""


class Daylight(LightSpectrum):
    """CIE standard illuminant D65 (daylight), the white of sRGB."""

    type: Literal["d65"]


class Blackbody(LightSpectrum):
    """A black body, by Planck's law: for example, a filament (2856 K, CIE illuminant A) or the sun (5778 K)."""

    type: Literal["blackbody"]
    temperature: Annotated[Number, Field(ge=500, le=1e6)]
    """Temperature, in kelvin."""


class Led(LightSpectrum):
    """Light-emitting diodes: a sum of Gaussians in wavelength."""

    type: Literal["led"]
    peaks: Annotated[list[tuple[Positive, Annotated[Number, Field(ge=2, le=500)], NonNegative]], Field(min_length=1)]
    """One [wavelength in nm, full width at half maximum in nm, relative height] per peak."""

    @model_validator(mode="after")
    def _shines(self) -> Led:
        if not any(height for _, _, height in self.peaks):
            raise invalid("no peak has a height", "give one more than 0", "peaks")
        for wavelength, _, _ in self.peaks:
            if not VISIBLE[0] <= wavelength <= VISIBLE[1]:
                raise invalid(f"{wavelength:g} nm is not visible", f"give {VISIBLE[0]:g} to {VISIBLE[1]:g} nm", "peaks")
        return self


class MeasuredLight(LightSpectrum):
    """The measured spectrum of a lamp. It is interpolated linearly, and is 0 outside the range of the wavelengths."""

    type: Literal["spectrum"]
    wavelengths: list[Positive] = Field(min_length=2)
    """Wavelengths in nm, ascending."""
    values: list[NonNegative] = Field(min_length=2)
    """Relative radiance at each of the wavelengths."""

    @model_validator(mode="after")
    def _curve(self) -> MeasuredLight:
        if len(self.values) != len(self.wavelengths):
            what = f"{len(self.values)} values, {len(self.wavelengths)} wavelengths"
            raise invalid(what, "give one value each", "values")
        if any(b <= a for a, b in pairwise(self.wavelengths)):
            raise invalid("the wavelengths do not ascend", "sort them", "wavelengths")
        if self.wavelengths[0] >= VISIBLE[1] or self.wavelengths[-1] <= VISIBLE[0] or not any(self.values):
            raise invalid("no part of it is visible", "give nanometers, 380 to 780", "wavelengths")
        return self


Texture = Annotated[ImageTexture, Tag("<texture>")]
Scalar = Annotated[
    Annotated[Number, Tag("<number>")] | Texture, _either("a number or a texture {type: imageTex, file}")
]
Index = Annotated[
    Annotated[Number, Tag("<number>")] | Annotated[str, Strict(), Tag("<name>")] | Texture,
    _either("a number, the name of a substance or a texture {type: imageTex, file}"),
]
Colour = Annotated[
    Annotated[Number, Tag("<number>")] | Annotated[Rgb, Tag("<list>")] | Texture,
    _either("[r, g, b], a number (gray) or a texture {type: imageTex, file}"),
]
Width = Annotated[
    Annotated[Number, Tag("<number>")]
    | Annotated[tuple[Scalar, Scalar], _of_length(2, "[along x, along y]"), Tag("<list>")]
    | Texture,
    _either("a number, two numbers [along x, along y] or a texture {type: imageTex, file}"),
]
Lamp = Annotated[Daylight | Blackbody | Led | MeasuredLight, Field(discriminator="type")]
Radiance = Annotated[
    Annotated[NonNegative, Tag("<number>")] | Annotated[Light, Tag("<list>")] | Annotated[Lamp, Tag("<texture>")],
    _either("[r, g, b], a number (gray) or a spectrum {type: d65, blackbody, led or spectrum}"),
]
Sky = Annotated[
    Annotated[NonNegative, Tag("<number>")] | Annotated[Light, Tag("<list>")] | Texture,
    _either("a texture {type: imageTex, file} or [r, g, b]"),
]


def rgb(value: float | tuple[float, float, float]) -> list[float]:
    """A color as three values; a single number is gray."""
    return [float(value)] * 3 if isinstance(value, (int, float)) else [float(c) for c in value]
