"""The parameters with respect to which a picture can be differentiated: those of materials, by path in the scene."""

from __future__ import annotations

from ..bridge.types import BSDFPlugin
from ..errors import InputError, did_you_mean
from ..material import BSDF, tree
from ..transport.gradients import Along
from .build import Built
from .schema import SceneDescription

CHANNELS = ("r", "g", "b")


def place_of(path: str, where: str) -> tuple[str, str]:
    """Split "shapes.0.material.base.alpha" into ("shapes.0.material", "base.alpha").

    where  the location that errors name
    """
    steps = path.removeprefix("scene.").split(".")
    if len(steps) < 3 or steps[0] != "shapes" or not steps[1].isdecimal() or steps[2] != "material":
        raise InputError(f"'{path}' names no material of a shape", where, 'such as "shapes.0.material.alpha"')
    return ".".join(steps[:3]), ".".join(steps[3:])


def material_at(description: SceneDescription, built: Built, place: str, where: str) -> BSDFPlugin:
    """The plugin of the material at the path `place`.

    Raises InputError, which names `where`, if the material is not one of Gonio's.
    """
    index = int(place.split(".")[1])
    if index >= len(description.shapes):
        raise InputError(f"no shape {index}", where, f"the scene has {len(description.shapes)}")
    part = description.shapes[index].material
    plugin = None if part is None else built.bsdfs.get(part)
    if plugin is None or not hasattr(plugin, "placed"):
        raise InputError("not a Gonio material, or one with a normal map", where, "name another")
    return plugin


def along(description: SceneDescription, built: Built, path: str) -> Along:
    """The variable given by a path such as "shapes.0.material.alpha" or "shapes.0.material.albedo.r".

    Raises InputError for parameters without derivatives.
    """
    where = f"gradient: {path}"
    place, parameter = place_of(path, where)
    plugin = material_at(description, built, place, where)
    model: BSDF = plugin.placed.model
    known = {leaf.path: leaf.parameter for leaf in tree.leaves(model) if leaf.parameter.numeric}
    head, _, last = parameter.rpartition(".")
    channel = CHANNELS.index(last) if last in CHANNELS and parameter not in known else None
    name = parameter if channel is None else head
    if name not in known:
        raise InputError(f"no parameter '{parameter}'", where, did_you_mean(parameter, [*known]))
    target = Along(plugin, name, channel)
    if channel is not None and known[name].kind != "spectrum":
        raise InputError(f"'{name}' is not a color", where, "leave the channel out")
    if target.slot.textures:
        raise InputError("a texture gives this value", where, "give the material a plain number")
    if known[name].kind == "angle" or name.rpartition(".")[2] in ("absorption", "priority"):
        raise InputError(f"'{name}' has no derivative here", where, "name a width, a color or an index")
    if model.delta != "never" or model.stochastic:
        what = "mirrors and smooth glass deflect light by an index" if not model.stochastic else "its values are random"
        raise InputError(f"{what}: no derivative", where, "name a material that is rough")
    return target
