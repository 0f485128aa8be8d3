"""The messages between page and server, which are described in docs/viewer.md: JSON from the page, JSON and frames from
the server.

All input is validated here (types, ranges, finiteness and sizes), so that the rest of the server can rely on it.
"""

from __future__ import annotations

import json
import math
import struct
from collections.abc import Mapping
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from ..errors import GonioError, InputError
from .page import PageData

TEXT_BYTES = 64 << 10  # a scene of 64 balls with all their parameters is a tenth of this
UPLOAD_BYTES = 64 << 20  # an environment of 4096 x 2048 half floats in RGBA
MAX_PIXELS = 1920 * 1080
MAX_BALLS, MAX_LIGHTS = 64, 16

Number = Annotated[float, Field(allow_inf_nan=False, ge=-1e9, le=1e9)]
Positive = Annotated[float, Field(allow_inf_nan=False, ge=0, le=1e9)]
Vector = tuple[Number, Number, Number]
Color = tuple[Positive, Positive, Positive]
Key = Annotated[str, Field(pattern=r"^[0-9A-Za-z_-]{1,80}$")]
Path = Annotated[str, Field(pattern=r"^[A-Za-z_][\w.]{0,120}$")]
Parameter = Annotated[float, Field(allow_inf_nan=False, ge=-3e38, le=3e38)]  # fits of He-Torrance reach specular = 3e13
Value = Parameter | tuple[Parameter, Parameter] | tuple[Parameter, Parameter, Parameter]
Choice = Annotated[str, Field(max_length=80)] | bool


def _direction(vector: Vector) -> Vector:
    if not math.hypot(*vector) > 1e-6:
        raise ValueError("a direction of length 0")
    return vector


class Part(BaseModel):
    """The base class of messages. Unknown keys, and strings in place of numbers, are invalid."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


class Directional(Part):
    type: Literal["directional"]
    direction: Annotated[Vector, AfterValidator(_direction)]
    irradiance: Color


class Point(Part):
    type: Literal["point"]
    position: Vector
    intensity: Color


class Area(Part):
    type: Literal["area"]
    center: Vector
    u: Annotated[Vector, AfterValidator(_direction)]
    v: Annotated[Vector, AfterValidator(_direction)]
    radiance: Color


class Image(Part):
    """A reference to a picture that was uploaded or is part of the page."""

    key: Key


class Environment(Part):
    type: Literal["environment"]
    image: Image | None = None
    constant: Color = (1.0, 1.0, 1.0)
    rotation: Number = 0.0
    scale: Positive = 1.0


Light = Annotated[Directional | Point | Area | Environment, Field(discriminator="type")]


class Camera(Part):
    target: Vector
    distance: Annotated[float, Field(gt=1e-3, le=1e6, allow_inf_nan=False)]
    azimuth: Number
    elevation: Number
    fov: Annotated[float, Field(ge=1, le=170, allow_inf_nan=False)]


class Row(Part):
    material: Key
    choices: dict[Path, Choice] = Field(default_factory=dict, max_length=32)
    balls: list[dict[Path, Value]] = Field(min_length=1, max_length=MAX_BALLS)


class State(Part):
    rows: list[Row] = Field(min_length=1, max_length=8)
    lights: list[Light] = Field(max_length=MAX_LIGHTS)
    camera: Camera
    spacing: Annotated[float, Field(ge=0, le=100, allow_inf_nan=False)] = 2.4


class Scene(Part):
    """A request to render a scene, which replaces the previous request."""

    type: Literal["scene"]
    id: Annotated[int, Field(ge=0, lt=2**53)]
    revision: Annotated[int, Field(ge=0, lt=2**53)] = 0
    width: Annotated[int, Field(ge=1, le=4096)]
    height: Annotated[int, Field(ge=1, le=4096)]
    state: State
    spp: Annotated[int, Field(ge=1, le=1 << 16)] = 256
    transport: Literal["local", "path"] = "local"
    max_depth: Annotated[int, Field(ge=2, le=16)] = 2


class Ack(Part):
    """An acknowledgment that the frame `frame` has been displayed, so that the next one may be sent."""

    type: Literal["ack"]
    frame: Annotated[int, Field(ge=0, lt=2**53)]


class Upload(Part):
    """An announcement that the next binary message is an environment, float16 RGBA, row 0 on top. Lights refer to the
    environment by its key."""

    type: Literal["upload", "environment"]
    key: Key
    width: Annotated[int, Field(ge=1, le=8192)]
    height: Annotated[int, Field(ge=1, le=8192)]

    @property
    def size(self) -> int:
        return self.width * self.height * 8


class Wish(Part):
    """A request for a material's shader with other choices, with the layers of the weights `on` although they are
    switched off, and with tables for the values `fixed`."""

    type: Literal["choice"]
    id: Annotated[int, Field(ge=0, lt=2**53)]
    revision: Annotated[int, Field(ge=0, lt=2**53)] = 0
    material: Key
    choices: dict[Path, Choice] = Field(max_length=32)
    on: list[Path] = Field(default=[], max_length=64)
    fixed: dict[Path, Value] = Field(default_factory=dict, max_length=64)


Message = Annotated[Scene | Ack | Upload | Wish, Field(discriminator="type")]
_message: TypeAdapter[Message] = TypeAdapter(Message)


def parse(text: str) -> Scene | Ack | Upload | Wish:
    """The message in a JSON text. Raises InputError with a description of the error if the message is invalid."""
    if len(text) > TEXT_BYTES:
        raise InputError(f"a message of {len(text)} characters", "message", f"send at most {TEXT_BYTES}")
    try:
        message = _message.validate_json(text)
    except ValidationError as error:
        first = error.errors(include_url=False, include_input=False)[0]
        place = "/".join(str(part) for part in first["loc"])
        raise InputError(_short(first["msg"]), _short(place) or "message", "see docs/viewer.md") from None
    except (ValueError, RecursionError) as error:
        raise InputError(f"not a message: {error}", "message", "see docs/viewer.md") from None
    if isinstance(message, Scene):
        _check(message)
    if isinstance(message, Upload) and message.size > UPLOAD_BYTES:
        what = f"a picture of {message.size >> 20} MiB"
        raise InputError(what, "upload", f"send at most {UPLOAD_BYTES >> 20} MiB; scale it down")
    return message


def _short(text: str, most: int = 200) -> str:
    """The text, shortened, because an error may be as long as the message."""
    return text if len(text) <= most else text[: most - 4] + " ..."


def _check(scene: Scene) -> None:
    if scene.width * scene.height > MAX_PIXELS:
        raise InputError(f"{scene.width} x {scene.height} pixels", "scene", f"request at most {MAX_PIXELS}")
    balls = sum(len(row.balls) for row in scene.state.rows)
    if balls > MAX_BALLS:
        raise InputError(f"{balls} balls", "scene/state/rows", f"show at most {MAX_BALLS}")
    if sum(isinstance(light, Environment) for light in scene.state.lights) > 1:
        raise InputError("more than one environment", "scene/state/lights", "keep one")


def environment(upload: Upload, content: bytes) -> NDArray[np.float32]:
    """The pixels of an upload, (height, width, 3) float32. Raises InputError if they do not match the announcement."""
    if len(content) != upload.size:
        raise InputError(f"{len(content)} bytes received, {upload.size} were announced", "upload", "send float16 RGBA")
    pixels = np.frombuffer(content, "<f2").reshape(upload.height, upload.width, 4)[..., :3].astype(np.float32)
    if not np.isfinite(pixels).all() or pixels.min() < 0:
        raise InputError("the picture has negative or infinite values", "upload", "remove them")
    return pixels


def failure(error: GonioError, kind: str = "error", wish: int | None = None) -> str:
    """An error as a message to the page.

    kind  "error", which is shown temporarily, or "fault", an error in the user's file, which is shown until the next
          "stage"
    wish  the id of the request that failed
    """
    asked = {} if wish is None else {"id": wish}
    return json.dumps({"type": kind, **asked, "what": error.what, "where": error.where, "hint": error.hint})


def stage(data: PageData) -> str:
    """A message with materials and rows that replace those of the page."""
    parts = {key: data[key] for key in ("revision", "materials", "scene", "dfg")}  # type: ignore[literal-required]
    return json.dumps({"type": "stage", **parts}, allow_nan=False)


def frame(header: Mapping[str, object], pixels: NDArray[np.float32]) -> bytes:
    """A frame: length of the header (uint32), header (JSON, padded to align the pixels to 4 bytes), and float16 RGBA.

    pixels  (height, width, 4), row 0 on top
    """
    height, width = pixels.shape[:2]
    text = json.dumps({**header, "width": width, "height": height, "format": "f16"}).encode()
    text += b" " * (-len(text) % 4)
    halves = np.clip(pixels, 0.0, np.finfo(np.float16).max).astype("<f2")
    return struct.pack("<I", len(text)) + text + halves.tobytes()
