"""The materials of scene files, derived from the parameters that each model declares.

There are two groups of types. The lab's six types have the keys, meanings and defaults of the lab (`LAB`). In addition,
every model of Gonio is available with its own parameters and defaults under a name such as `gonio-conductor`, and
without the prefix unless the lab uses this name. New models require no change here. Neither do materials that are
registered later, nor classes in a Python file in the scene's folder, such as "ward.py:Ward", which are executed only if
code is allowed.
"""

from __future__ import annotations

import functools
import inspect
import math
import threading
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import (
    TYPE_CHECKING,
    Annotated,
    Any,
    ClassVar,
    ForwardRef,
    Literal,
    NamedTuple,
    TypeAlias,
    TypeVar,
    Union,
    cast,
)

import numpy as np
from pydantic import (
    AfterValidator,
    Discriminator,
    Field,
    PlainValidator,
    PrivateAttr,
    Strict,
    Tag,
    ValidationInfo,
    WithJsonSchema,
    create_model,
    model_validator,
)
from pydantic_core import PydanticCustomError

from ..catalog import documents, library, outside, shaders
from ..catalog.documents import Document
from ..catalog.texts import SHADER
from ..errors import GonioError, GonioWarning, InputError
from ..material import BSDF, Parameter, models
from ..material.parameters import ChoiceParameter, IndexParameter, IntegerParameter
from ..measure import SAMPLE, parted
from ..optics.dispersion import DispersiveIndex
from .files import located
from .values import BumpMap, Colour, ImageTexture, Index, NormalMap, Part, Scalar, Width, invalid

Model = type[BSDF]
Locate: TypeAlias = Callable[[str, str], Path]
T = TypeVar("T")

# the possible values of a parameter in a scene file
Value: TypeAlias = "float | bool | str | ImageTexture | MaterialPart | tuple[float | ImageTexture, ...]"


@dataclass(frozen=True)
class LabType:
    """The mapping of a type of the lab's format to a model.

    renamed   keys of the lab -> parameters that they set, with unchanged values
    defaults  parameters whose default in the lab differs from that of the model
    required  keys that the lab requires
    ignored   keys that are accepted but have no effect
    """

    model: str
    doc: str
    renamed: dict[str, str] = field(default_factory=dict)
    defaults: Mapping[str, float | str] = field(default_factory=dict)
    required: tuple[str, ...] = ()
    ignored: tuple[str, ...] = ()


_LAB_MICROFACETS = {"ndf": "beckmann", "masking": "smith-separable", "fresnel": "schlick"}
LAB = {
    "matte": LabType("lambert", "Ideal diffuse reflection.", defaults={"albedo": 0.5}),
    "mirror": LabType("mirror", "Ideal mirror; its reflectance is 1, regardless of `albedo`.", ignored=("albedo",)),
    "phong": LabType("phong", "kd cos_i + ks (v.r)^p, as in eq. 1 of the lab sheet.", required=("p",)),
    "oren-nayar": LabType(
        "oren-nayar", "Oren-Nayar, with sigma = `roughness`.", {"roughness": "sigma"}, required=("roughness",)
    ),
    "conductor": LabType(
        "conductor",
        "Rough metal, with alpha = `roughness`. The default terms are Beckmann, separable Smith and Schlick.",
        {"roughness": "alpha"},
        _LAB_MICROFACETS,
        required=("roughness",),
    ),
    "dielectric": LabType(
        "dielectric",
        "Rough glass, with alpha = `roughness`. The default terms are Beckmann, separable Smith and Schlick.",
        {"roughness": "alpha"},
        _LAB_MICROFACETS,
        required=("roughness",),
    ),
}


class Argument(NamedTuple):
    """The value of a parameter in a scene, and its key in the file.

    squared  whether the parameter is the square of the value
    """

    value: Value
    key: str
    squared: bool = False


class MaterialPart(Part):
    """The base class of all materials; `_declare` creates the subclasses."""

    type: str
    normalmap: NormalMap | None = None
    """An image of normals."""
    bump: BumpMap | None = None
    """An image of heights."""
    two_sided: Annotated[bool, Strict()] | None = None
    """Whether both sides reflect in the same way. The default is true for all materials that transmit no light."""

    _given: bool = PrivateAttr(False)  # whether a program created it; file paths are then used unchanged
    _source: str = PrivateAttr("")  # the document that contains the material
    _notices: tuple[str, ...] = PrivateAttr(())  # features of the document that could not be converted
    model: ClassVar[Model]
    declared: ClassVar[dict[str, Parameter]]  # key in the file -> the parameter that it sets
    dials: ClassVar[dict[str, str]]  # key of a perceptual roughness -> the parameter alpha whose square root it is
    lab: ClassVar[LabType | None]

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle by the name of the type, because the classes are created at run time and belong to no module."""
        return _pickled, (self.type, self.model, dict(self.__dict__), set(self.model_fields_set))

    def get(self, key: str) -> Value | None:
        return getattr(self, _attribute(key))

    def arguments(self) -> dict[str, Argument]:
        """The values that the file gives or the lab defines, by the name of the parameter."""
        arguments: dict[str, Argument] = {}
        if self.lab:
            arguments.update({name: Argument(value, name) for name, value in self.lab.defaults.items()})
        for key, parameter in self.declared.items():
            if (value := self.get(key)) is not None:
                arguments[parameter.name] = Argument(value, key)
        for dial, width in self.dials.items():
            if (value := self.get(dial)) is not None:
                arguments[width] = Argument(value, dial, squared=True)
        return arguments

    @property
    def preset(self) -> str | None:
        preset: str | None = self.__dict__.get(_attribute("preset"))
        return preset

    def code(self) -> list[Path]:
        """The user's Python files that the material executes.

        These are the files of its class, distribution, masking term and so on, and the modules that they import from
        their folders.
        """
        texts = [inspect.getsourcefile(self.model) or ""] if outside.is_outside(self.model) else []
        for name, (value, _, _) in self.arguments().items():
            parameter = self.model.parameters()[name]
            if isinstance(parameter, ChoiceParameter) and isinstance(value, str):
                spelled = parameter.spelled(value)
                texts += [spelled.rpartition(":")[0]] if outside.names_code(spelled) else []
        return [file for text in texts for file in outside.with_imports(Path(text))]

    def located(self, file: str, locate: Locate | None, pointer: str) -> str:
        """The path of a file that is a parameter. It must be in the scene's folder unless outside files are allowed."""
        path, item = parted(file)
        if not self._given and locate is not None and path != SAMPLE:
            path = str(locate(path, pointer))
        return f"{path}:{item}" if item else path

    def instance(self, locate: Locate | None = None, where: str = "") -> BSDF:
        """The model with the values of this material, in which textured parameters have their defaults.

        locate  a function that returns the path of a file, given its name in the scene and a JSON pointer
        where   JSON pointer to this material
        Raises InputError for combinations that the model rejects, such as two-sided glass.
        """
        parameters = self.model.parameters()
        values: dict[str, Any] = {}
        for name, (value, key, squared) in self.arguments().items():
            if isinstance(value, MaterialPart):
                values[name] = value.instance(locate, f"{where}/{key}")
            elif parameters[name].kind == "file" and isinstance(value, str):
                values[name] = self.located(value, locate, f"{where}/{key}")
            elif isinstance(value, (bool, str)):
                values[name] = value
            elif not any(isinstance(item, ImageTexture) for item in _items(value)):
                numbers = [item**2 if squared else item for item in numbers_in(value)]
                values[name] = tuple(numbers) if isinstance(value, (list, tuple)) else numbers[0]
        for name, parameter in parameters.items():
            if parameter.required and name not in values:
                values[name] = min(max(0.5, parameter.low), parameter.high)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", GonioWarning)  # `reader` issues them with the location in the file
            return self.model(**values)

    @classmethod
    @functools.cache
    def _spellings(cls) -> dict[str, list[str]]:
        """The keys that set each parameter, by the name of the parameter."""
        spellings: dict[str, list[str]] = {}
        for key, parameter in cls.declared.items():
            spellings.setdefault(parameter.name, []).append(key)
        for dial, width in cls.dials.items():
            spellings.setdefault(width, []).append(dial)
        return spellings

    @model_validator(mode="after")
    def _one_spelling(self) -> MaterialPart:
        for name, keys in self._spellings().items():
            given = [key for key in keys if self.get(key) is not None]
            if len(given) > 1:
                raise invalid(
                    f"both '{given[0]}' and '{given[1]}' are given", f"they set the same {name}; keep one", given[1]
                )
            needed = [key for key in keys if self.lab and key in self.lab.required]
            if needed and not given:
                raise invalid(f"key '{needed[0]}' is missing", f"give one of {', '.join(keys)}")
        if self.normalmap is not None and self.bump is not None:
            raise invalid("both 'normalmap' and 'bump' are given", "both perturb the normal; keep one", "bump")
        self._check_preset()
        return self

    def _check_preset(self) -> None:
        if self.preset is None:
            return
        sets = {name for preset in self.model.presets().values() for name in preset.values}
        conflicting = [key for key, p in self.declared.items() if p.name in sets and self.get(key) is not None]
        if conflicting:
            what = f"both 'preset' and '{conflicting[0]}' are given"
            raise invalid(what, f"a preset sets {conflicting[0]}; keep one", "preset")
        try:
            self.model.preset(self.preset)
        except InputError as error:
            raise invalid(error.what, error.hint, "preset") from None


def _attribute(key: str) -> str:
    # The prefix prevents a parameter from hiding a method of pydantic (`copy`, `json`) or of this class.
    return f"value_{key}"


_KINDS: dict[str, Any] = {
    "float": Scalar,
    "angle": Scalar,
    "spectrum": Colour,
    "alpha": Width,
    "flag": Annotated[bool, Strict()],
    "file": Annotated[str, Strict(), Field(min_length=1)],
    "bsdf": ForwardRef("Material"),
}


def numbers_in(value: object) -> tuple[float, ...]:
    """The plain numbers of a value: the value itself, the channels of a color, or the items of a pair."""
    if isinstance(value, (list, tuple)):
        return tuple(number for item in value for number in numbers_in(item))
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return (float(value),)
    return ()


def _items(value: Value) -> tuple[Value, ...]:
    return tuple(value) if isinstance(value, (list, tuple)) else (value,)


def _in_range(parameter: Parameter, key: str) -> Callable[[T], T]:
    def check(value: T) -> T:
        if isinstance(value, str):
            try:
                parameter.coerce(value, key)
            except GonioError as error:
                raise invalid(error.what, error.hint) from None
        for number in numbers_in(value):
            if number < parameter.low or (number > parameter.high and not parameter.soft_high):
                raise invalid(f"{number:g} is out of range: {key} is {parameter.range}", _doc(parameter))
        return value

    return check


def _chosen(parameter: ChoiceParameter, key: str) -> Callable[[object, ValidationInfo], str]:
    """A validator of names, which accepts members that were registered later, and FILE.py:CLASS if code is allowed."""

    def check(value: object, info: ValidationInfo) -> str:
        if isinstance(value, str) and parameter.family is not None and outside.names_code(value):
            context = info.context or {}
            if not context.get("allow_code"):
                raise _no_code(value)
            try:
                return outside.member(value, context.get("folder"), key, parameter.family)
            except InputError as error:
                raise invalid(f"{error.where}: {error.what}", error.hint) from None
        if isinstance(parameter, IntegerParameter):
            try:
                return str(parameter.coerce(value, key))
            except InputError as error:
                raise invalid(error.what, error.hint) from None
        known = parameter.choices
        if not isinstance(value, str) or value not in known:
            *names, last = [f"'{name}'" for name in known]
            expected = f"{', '.join(names)} or {last}" if names else last
            raise PydanticCustomError("literal_error", "one of the names", {"expected": expected})
        return value

    return check


def _choice_schema(parameter: ChoiceParameter) -> dict[str, Any]:
    if isinstance(parameter, IntegerParameter):
        return {"type": ["integer", "string"]}
    names: dict[str, Any] = {"type": "string", "enum": list(parameter.choices)}
    return names if parameter.family is None else {"anyOf": [names, {"type": "string", "pattern": _CODE}]}


_CODE = r"\.py:\w+$"


def _no_code(name: str, key: str = "") -> PydanticCustomError:
    hint = "read the file first; then --allow-code lets the scene run it"
    return invalid(f"'{name}' is code, which a scene alone does not run", hint, key)


def _doc(parameter: Parameter) -> str:
    unit = f" [{parameter.unit}]" if parameter.unit else ""
    return f"{parameter.name}: {parameter.doc}{unit}"


def _field(parameter: Parameter, key: str, required: bool, doc: str = "") -> tuple[Any, Any]:
    if isinstance(parameter, ChoiceParameter):
        kind: Any = Annotated[str, PlainValidator(_chosen(parameter, key)), WithJsonSchema(_choice_schema(parameter))]
    else:
        of_kind = Index if isinstance(parameter, IndexParameter) else _KINDS[parameter.kind]
        kind = Annotated[of_kind, AfterValidator(_in_range(parameter, key))]
    doc = doc or f"{parameter.doc} ({parameter.range})"
    # JSON Schema applies minimum and maximum only to numbers, so they do not affect lists and textures.
    limits = {"minimum": parameter.low, "maximum": math.inf if parameter.soft_high else parameter.high}
    extra: dict[str, Any] = {name: limit for name, limit in limits.items() if math.isfinite(limit)}
    if required:
        return kind, Field(alias=key, description=doc, json_schema_extra=extra)
    return kind | None, Field(None, alias=key, description=doc, json_schema_extra=extra)


def _declare(names: tuple[str, ...], model: type[BSDF], lab: LabType | None) -> type[MaterialPart]:
    """The pydantic class of one material type."""
    parameters = model.parameters()
    declared = dict(parameters)
    dials: dict[str, str] = {}
    docs: dict[str, str] = {}
    if lab:
        declared = {key: p for key, p in declared.items() if key not in lab.ignored}
        for key, name in lab.renamed.items():
            declared[key] = parameters[name]
            docs[key] = f"The same as {name} in the lab's format: {parameters[name].doc} ({parameters[name].range})"
    else:
        for name, parameter in parameters.items():
            dial = name.replace("alpha", "roughness")
            if parameter.kind == "alpha" and dial not in parameters:
                dials[dial] = name
                docs[dial] = f"The artist's parameter instead of {name}: {name} = {dial}^2. Giving both is an error."
    fields: dict[str, Any] = {"type": (Literal[names], Field(description=lab.doc if lab else _summary(model)))}
    for key, parameter in declared.items():
        # `_one_spelling` checks the keys of the lab that have a second spelling.
        required = key in lab.required and key not in lab.renamed if lab else parameter.required
        fields[_attribute(key)] = _field(parameter, key, required, docs.get(key, ""))
    for dial, name in dials.items():
        fields[_attribute(dial)] = _field(parameters[name], dial, False, docs[dial])
    for key in lab.ignored if lab else ():
        fields[_attribute(key)] = (Colour | None, Field(None, alias=key, description="This key has no effect."))
    if model.presets():
        doc = f'Name of a preset, whose values replace the numbers, e.g. "{next(iter(model.presets()))}".'
        fields[_attribute("preset")] = (Annotated[str, Strict()] | None, Field(None, alias="preset", description=doc))
    if model.spelling:
        fields[_attribute("file")] = (str | None, Field(None, alias="file", description="The shader file."))
    title = "".join(word.capitalize() for word in names[0].split("-"))
    doc = lab.doc if lab else _summary(model)
    cls = create_model(title, __base__=MaterialPart, __doc__=doc, **fields)
    cls.model, cls.declared, cls.dials, cls.lab = model, declared, dials, lab
    return cls


def _summary(model: type[BSDF]) -> str:
    return (model.__doc__ or model.__name__).strip().splitlines()[0]


def _spellings(name: str) -> tuple[str, ...]:
    """The names of a model in a scene, with hyphens or underscores, and without the prefix unless the lab uses the
    name.
    """
    plain = () if name in LAB else (name,)
    return tuple(dict.fromkeys(s for n in (*plain, f"gonio-{name}") for s in (n, n.replace("-", "_"))))


class _Declared(Mapping[str, type[MaterialPart]]):
    """The class of each type, by its names in a scene.

    The classes are created on first access, because creating all of them takes a second.
    """

    def __init__(self) -> None:
        known = models()
        self._lab = {name: known[lab.model] for name, lab in LAB.items()}
        self._others = {spelling: name for name in known for spelling in _spellings(name)}
        self._made: dict[str, type[MaterialPart]] = {}
        self._lock = threading.RLock()

    def __getitem__(self, name: str) -> type[MaterialPart]:
        own = name if name in self._lab else self._others[name]
        with self._lock:
            if name not in self._made:
                names = (name,) if name in self._lab else _spellings(own)
                part = _declare(names, self._lab.get(name) or models()[own], LAB.get(name))
                part.model_rebuild(_types_namespace={"Material": Material})
                self._made |= dict.fromkeys(names, part)
            return self._made[name]

    def __iter__(self) -> Iterator[str]:
        yield from (*self._lab, *self._others)

    def __len__(self) -> int:
        return len(self._lab) + len(self._others)


BY_TYPE = _Declared()
OWN = "FILE.py:CLASS"  # tag of Gonio's materials; the tag of materials in other programs' files is the format's name


@functools.cache
def _own_part(name: str, model: Model) -> type[MaterialPart]:
    part = _declare((name,), model, None)
    part.model_rebuild(_types_namespace={"Material": Material})
    return part


def part_of(name: str) -> type[MaterialPart] | None:
    """The class for materials of a type, including types that were registered later; None for an unknown type."""
    if name in BY_TYPE:
        return BY_TYPE[name]
    if library.knows(name):
        return BY_TYPE[library.named(name)[0].name]
    model: Any = models().get(name.replace("_", "-").removeprefix("gonio-"))  # Any, since mypy thinks it unhashable
    return None if model is None else _own_part(name, model)


def described(material: BSDF) -> MaterialPart:
    """The representation of a material object in a scene."""
    cls: Any = type(material)
    name = f"gonio-{material.name}"
    if cls.spelling:
        part = _own_part(SHADER, cls)
        fields: dict[str, Any] = {"type": SHADER, "file": cls.spelling}
    else:
        part = BY_TYPE[name] if name in BY_TYPE and BY_TYPE[name].model is cls else _own_part(material.name, cls)
        fields = {"type": name if part.model.__module__.startswith("gonio.") else material.name}
    for key, parameter in part.declared.items():
        value = getattr(material, parameter.name)
        if parameter.inner:
            fields[key] = described(value)
        elif isinstance(value, DispersiveIndex):
            fields[key] = value.constants.name
        elif isinstance(value, Path):
            fields[key] = str(value)
        elif value is not None:
            fields[key] = np.asarray(value).tolist() if parameter.numeric else value
    made = part.model_validate(fields)
    made._given = True
    return made


def _pickled(name: str, model: Model, values: dict[str, Any], given: set[str]) -> MaterialPart:
    """Restore a pickled `MaterialPart`."""
    known, own = BY_TYPE.get(name), cast(Any, model)
    cls: Any = known if known is not None and known.model is model else _own_part(name, own)
    return cls.model_construct(given, **values)


class DocumentPart(Part):
    """A material in another program's file, converted to Gonio's own materials with its numbers and textures."""

    type: Literal[tuple(Document.family.all())]  # type: ignore[valid-type]
    """The format of the file."""
    file: str = Field(min_length=1)
    """The file, in the scene's folder; its textures must lie in its own folder."""
    material: Annotated[str, Strict()] | None = None
    """The material in the file, by name, or by number if it has no name; not needed if there is only one."""
    two_sided: Annotated[bool, Strict()] | None = None
    """Whether both sides reflect in the same way, as for any material."""


def _from_document(part: DocumentPart | MaterialPart, info: ValidationInfo) -> MaterialPart:
    """The material to which a `DocumentPart` refers."""
    if isinstance(part, MaterialPart):
        return part
    context = info.context or {}
    document = Document.family.get(part.type)
    try:
        path = located(part.file, context.get("folder", Path()), "", context.get("allow_outside", False))
        if path.suffix.lower() not in document.suffixes:
            known = ", ".join(document.suffixes)
            raise InputError(f"'{part.file}' is not a {part.type} file by its name", "", f"it ends in {known}")
        described = documents.read(document, path, part.material or "")
    except GonioError as error:
        what = f"{error.where}: {error.what}" if error.where else error.what
        raise invalid(what, error.hint, "file") from None
    fields: Any = _relative_to_scene(documents.for_scenes(described.notation), Path(part.file).parent)
    if part.two_sided is not None:
        fields["two_sided"] = part.two_sided
    material = _own(fields, info)
    material._source, material._notices = part.file, described.notices
    return material


def _relative_to_scene(notation: Mapping[str, object], folder: Path) -> dict[str, object]:
    """The notation of a material, with file paths relative to the scene's folder."""
    relative: dict[str, object] = {}
    for key, value in notation.items():
        if key == "file":
            relative[key] = (folder / str(value)).as_posix()
        else:
            relative[key] = _relative_to_scene(value, folder) if isinstance(value, dict) else value
    return relative


def _tag(value: object) -> str | None:
    if isinstance(value, DocumentPart):
        return value.type
    name = value.get("type") if isinstance(value, dict) else OWN
    return name if name is None or (isinstance(name, str) and name in Document.family.all()) else OWN


def _own(value: object, info: ValidationInfo) -> MaterialPart:
    """The material of a given type: one of Gonio's, of the library, registered, or, if code is allowed, from a file."""
    if isinstance(value, MaterialPart):
        return value
    if not isinstance(value, dict):
        raise PydanticCustomError("dict_type", "an object expected")
    name, context = value["type"], info.context or {}
    if not isinstance(name, str):
        raise invalid(f"unknown type '{name}'", "known: " + ", ".join(sorted(BY_TYPE)), "type")
    if name not in BY_TYPE and not outside.names_code(name) and library.resembles(name):
        return _from_library(name, value, context)
    if name == SHADER:
        return _from_shader(value, context)
    part = part_of(name)
    if part is None:
        if not outside.names_code(name):
            known = ", ".join(f"'{one}'" for one in (*BY_TYPE, *Document.family.all()))
            raise PydanticCustomError("union_tag_invalid", "unknown type", {"tag": name, "expected_tags": known})
        if not context.get("allow_code"):
            raise _no_code(name, "type")
        try:
            code: Any = outside.load(name, context.get("folder"))
            part = _own_part(name, code)
        except InputError as error:
            raise invalid(f"{error.where}: {error.what}", error.hint, "type") from None
    return part.model_validate(value, context=context)


def _from_shader(value: dict[str, Any], context: dict[str, Any]) -> MaterialPart:
    """A material from a shader in the scene's folder. Shaders cannot execute native code."""
    file = value.get("file")
    if not isinstance(file, str) or not file:
        raise invalid("a shader needs a 'file'", 'such as {"type": "shader", "file": "my.glsl"}', "file")
    folder, anywhere = context.get("folder", Path()), context.get("allow_outside", False)
    try:
        name, options = shaders.parted(file)
        path = located(name, folder, "", anywhere)
        if not shaders.names_shader(str(path)):
            raise InputError(f"'{file}' is not a shader by its name", "", ", ".join(shaders.SUFFIXES))
        model: Any = shaders.class_of(f"{path}?{options}" if options else str(path), None if anywhere else folder)
    except GonioError as error:
        raise invalid(f"{error.where}: {error.what}" if error.where else error.what, error.hint, "file") from None
    return _own_part(SHADER, model).model_validate(value, context=context)


def _from_library(name: str, value: dict[str, Any], context: dict[str, Any]) -> MaterialPart:
    """A material of the library, as its model with a preset."""
    try:
        model, preset = library.named(name)
    except InputError as error:
        raise invalid(error.what, error.hint, "type") from None
    return BY_TYPE[model.name].model_validate({**value, "type": model.name, "preset": preset}, context=context)


# a placeholder for all of Gonio's materials in a generated schema, because there are many and they can be nested
PLACEHOLDER = {"$comment": "any material"}

if TYPE_CHECKING:
    Material: TypeAlias = MaterialPart
else:
    _members: list[Any] = [
        Annotated[DocumentPart, AfterValidator(_from_document), Tag(name)] for name in Document.family.all()
    ]
    _members.append(Annotated[MaterialPart, PlainValidator(_own), WithJsonSchema(PLACEHOLDER), Tag(OWN)])
    Material = Annotated[Union[tuple(_members)], Discriminator(_tag)]  # noqa: UP007


def any_material(references: Iterable[dict[str, str]]) -> dict[str, Any]:
    """The schema of any material, given references to the schemas of Gonio's materials."""
    pattern = {"type": {"type": "string", "pattern": _CODE}}
    own = {"type": "object", "properties": pattern, "required": ["type"], "description": "A class in a Python file."}
    properties = {"type": {"const": SHADER}, "file": {"type": "string", "minLength": 1}}
    shader = {"type": "object", "properties": properties, "required": ["type", "file"], "description": "A shader."}
    return {"oneOf": [*references, own, shader]}
