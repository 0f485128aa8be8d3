"""Construct a Mitsuba scene from a validated description."""

from __future__ import annotations

import re
import warnings
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

import numpy as np

from ..bridge.faults.merged_mesh_bbox import compute_boxes
from ..bridge.faults.shape_order import shape_key
from ..bridge.types import BSDFPlugin, Plugin, PluginDict, Scene
from ..catalog import documents
from ..errors import GonioWarning, InputError, MachineError
from ..material import Parameter
from ..materials.combined.normal_map import slopes
from ..pictures.images import RGB
from ..transport import fast
from . import meshes, schema, spectra, textures
from .materials import BY_TYPE, MaterialPart, Value, numbers_in
from .text import pointer
from .values import BumpMap, ImageTexture, NormalMap

if TYPE_CHECKING:
    from ..transport.fast.by_shape import Group

# An error raised by Gonio in the plugin of a material, at the end of the traceback that Mitsuba reports: kind, where,
# what, hint
_RAISED = re.compile(r"\n(InputError|MachineError): ([^\n]*?): ([^\n]+)\n  hint: ([^\n]+)\Z")

FAR = 4.0  # distance from the origin, relative to the longest side of the scene, from which a scene is moved there
MERGE_FROM = 64  # minimum number of materials with equal structure that are merged into one BSDF

# Maps the local axes +z, +x, +y of Mitsuba's sphere, where u is the azimuth about z from x toward y and v increases
# from +z, to +y, +z, +x of the format, where u is the azimuth about y from z toward x and v increases from +y.
_SPHERE_AXES = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])


def build(description: schema.SceneDescription, mi: ModuleType) -> Scene:
    """Build an `mi.Scene` from a description: shapes `shape0`, ..., lights `light0`, ..., and `sensor` with its film.

    Shapes with equal materials share one BSDF. Raises InputError for an unusable image or mesh.
    """
    return built(description, mi, merge_materials=True).scene


@dataclass(frozen=True)
class Built:
    """A Mitsuba scene, and the BSDF of each material in its description."""

    scene: Scene
    bsdfs: Mapping[MaterialPart, BSDFPlugin]


def built(description: schema.SceneDescription, mi: ModuleType, merge_materials: bool = False) -> Built:
    """Build the scene like `build`, and return it with its BSDFs, for callers that change them.

    merge_materials  whether to represent many materials that differ only in numbers by one BSDF, which is not listed in
                     `bsdfs`
    """
    builder = _Builder(description, mi, merge_materials)
    scene = builder.scene()
    low, high = (np.array(end, float) for end in (scene.bbox().min, scene.bbox().max))
    if np.isfinite([low, high]).all() and np.abs(low + high).max() / 2.0 > FAR * (high - low).max():
        # details matter most near the point at which the camera looks
        builder = _Builder(description, mi, merge_materials, np.clip(description.camera.transform.look_at, low, high))
        scene = builder.scene()
    return Built(scene, builder.bsdfs)


class _Builder:
    """Builds a scene in coordinates relative to `origin`.

    The offset of rays from surfaces is proportional to the coordinates, so a scene far from the origin would lose light
    where objects touch.
    """

    def __init__(
        self,
        description: schema.SceneDescription,
        mi: ModuleType,
        merge_materials: bool,
        origin: np.ndarray | None = None,
    ) -> None:
        from ..bridge import adapter
        from ..transport.lights import lights  # imported here, because this initializes Dr.Jit

        adapter.register(mi)
        self.adapter = adapter
        lights.register(mi)
        self.description, self.mi = description, mi
        self.origin = np.zeros(3) if origin is None else origin
        self.bsdfs: dict[MaterialPart, BSDFPlugin] = {}
        self.images: dict[tuple[Path, str, str | None, bool], RGB] = {}
        # only in RGB, because spectral variants upsample each color separately
        self.merge_materials = merge_materials and fast.enabled() and mi.variant().endswith("rgb")
        self.gathered: dict[MaterialPart, tuple[BSDFPlugin, Group, int]] = {}

    def scene(self) -> Scene:
        scene: PluginDict = {"type": "scene", "sensor": self.sensor()}
        if self.merge_materials:
            self.gather()
        shapes: PluginDict = {"type": "merge"}
        for index, shape in enumerate(self.description.shapes):
            part = self.shape(shape, pointer("scene", "shapes", index), f"shape{index}")
            (shapes if isinstance(part, dict) else scene)[f"shape{index}"] = part
        for index, light in enumerate(self.description.lights):
            part = self.light(light, pointer("scene", "lights", index), f"light{index}")
            plain = isinstance(light, schema.AreaLight) and isinstance(part, dict)
            (shapes if plain else scene)[f"light{index}"] = part
        # Mitsuba would merge the meshes of a scene in random order, which would change the order of the lights and thus
        # the picture. Therefore meshes are merged and sorted here.
        merged = self.load(shapes, "/scene") if len(shapes) > 1 else []
        merged = merged if isinstance(merged, list) else [merged]
        compute_boxes(merged)
        for index, one in enumerate(sorted(merged, key=shape_key)):
            scene[one.id() or f"merged{index}"] = one
        loaded = self.load(scene, "/scene", optimize=False)
        if self.gathered:
            from ..transport.fast import by_shape

            by_shape.bind(self.mi, loaded, {id(group): group for _, group, _ in self.gathered.values()}.values())
        return loaded

    def load(self, plugin: PluginDict, where: str, optimize: bool = True) -> Plugin:
        """Load the Mitsuba object of a dictionary. Raises InputError at `where` if Mitsuba rejects it."""
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", GonioWarning)  # the reader has issued them with the location
                # sequentially, because the order of the objects, and thus the kernels, would otherwise be random
                return self.mi.load_dict(plugin, parallel=False, optimize=optimize)
        except InputError as error:
            raise InputError(error.what, self.description.where(where), error.hint) from None
        except RuntimeError as error:
            text = str(error).strip()
            if raised := _RAISED.search(text):
                kind, at, what, hint = raised.groups()
                if kind == "MachineError":  # not caused by the scene
                    raise MachineError(what, at, hint) from None
                raise InputError(what, self.description.where(where), hint) from None
            raise InputError(
                f"Mitsuba rejects it: {text.splitlines()[-1][:200]}",
                self.description.where(where),
                "simplify this part, and report it if it should work",
            ) from error

    def moved(self, point: Sequence[float]) -> list[float]:
        """The coordinates of a point relative to `origin`."""
        return [float(x) for x in np.subtract(point, self.origin)]

    def sensor(self) -> PluginDict:
        camera = self.description.camera
        placed = camera.transform
        width, height = camera.film.size
        if camera.polarizer is not None and not self.mi.is_polarized:
            what = f"a polarizer needs a polarized variant, which {self.mi.variant()} is not"
            hint = "`gonio render` and go.render choose one; otherwise set the variant llvm_ad_spectral_polarized first"
            raise InputError(what, self.description.where("/camera/polarizer"), hint)
        return {
            "type": "perspective",
            "fov": camera.vertical_fov,
            "fov_axis": "y",
            "near_clip": camera.t_near,
            "far_clip": camera.t_far,
            "to_world": self.mi.ScalarTransform4f().look_at(
                self.moved(placed.position), self.moved(placed.look_at), list(placed.up)
            ),
            "film": {
                "type": "hdrfilm",
                "width": width,
                "height": height,
                "rfilter": {"type": "box"},  # in the lab, a pixel is the mean of its samples
                "pixel_format": "rgb",
                "component_format": "float32",
            },
            "sampler": {"type": "independent", "sample_count": min(self.description.spp, 2**16)},
        }

    # ------------------------------------------------------------------ lights

    def light(self, light: schema.LightSource, where: str, name: str) -> Plugin | PluginDict:
        if isinstance(light, schema.AreaLight):
            # Mitsuba merges Python plugins with equal properties; the tag prevents it from merging equal lamps
            emitter = {"type": "gonio_area", "radiance": spectra.emitted(light.energy), "tag": name}
            return self.shape(light.shape, f"{where}/shape", name, emitter)
        if isinstance(light, schema.SpotLight):
            intensity = spectra.emitted(light.energy)
            return {"type": "point", "position": self.moved(light.position), "intensity": intensity}
        if isinstance(light, schema.DirectionalLight):
            irradiance = spectra.emitted(light.energy)
            return {"type": "directional", "direction": light.unit().tolist(), "irradiance": irradiance}
        source = light.texture if light.texture is not None else light.radiance
        assert source is not None, "exactly one of the two is given"
        if isinstance(source, ImageTexture):
            values = self.values(source, f"{where}/texture")
            if (values < 0.0).any():
                row, column = np.argwhere(values < 0.0)[0][:2]
                what = f"the radiance at row {row}, column {column} is below 0"
                raise InputError(what, f"{where}/texture", "correct the image: light is not negative")
            return textures.environment(self.mi, values)
        return {"type": "constant", "radiance": spectra.emitted(source)}

    # ------------------------------------------------------------------ shapes

    def shape(
        self, shape: schema.Shape, where: str, name: str, emitter: PluginDict | None = None
    ) -> Plugin | PluginDict:
        matrix = shape.transform.matrix()
        matrix[:3, 3] -= self.origin
        material = shape.material or BY_TYPE["matte"](type="matte")
        # an object instead of a dictionary, because Mitsuba merges equal dictionaries, and an emitter cannot belong to
        # two shapes
        source = None if emitter is None else self.load(emitter, where)
        native = self.native_shape(shape, matrix)
        if native is not None and material in self.gathered:
            native["bsdf"], group, row = self.gathered[material]
            group.shapes[name] = row
        elif native is not None:
            native["bsdf"] = self.bsdf(material, f"{where}/material")
        if native is not None:
            if source is not None:
                native["emitter"] = source
            return native
        bsdf = self.bsdf(material, f"{where}/material")
        return self.triangles(shape, where).transformed(matrix).to_mitsuba(self.mi, name, bsdf, source)

    def native_shape(self, shape: schema.Shape, matrix: np.ndarray) -> PluginDict | None:
        """The equivalent exact shape of Mitsuba; None if there is none."""
        to_world = np.eye(4)
        if isinstance(shape, schema.Sphere):
            rotation = shape.transform.rotate
            axes = _SPHERE_AXES if rotation is None else rotation.matrix() @ _SPHERE_AXES
            to_world[:3, :3] = shape.radius * axes
            to_world[:3, 3] = matrix[:3, :3] @ shape.center + matrix[:3, 3]
            return {"type": "sphere", "to_world": self.mi.ScalarTransform4f(to_world)}
        if isinstance(shape, schema.Parallelogram):
            edge0, edge1 = matrix[:3, :3] @ shape.edge0, matrix[:3, :3] @ shape.edge1
            normal = np.cross(edge0, edge1)
            # Mitsuba's rectangle is [-1, 1]^2; it remains exact if it is sheared.
            to_world[:3, 0], to_world[:3, 1] = edge0 / 2, edge1 / 2
            to_world[:3, 2] = normal / np.linalg.norm(normal)
            to_world[:3, 3] = (matrix @ [*shape.base, 1.0])[:3] + (edge0 + edge1) / 2
            return {"type": "rectangle", "to_world": self.mi.ScalarTransform4f(to_world)}
        return None

    def triangles(self, shape: schema.Shape, where: str) -> meshes.Triangles:
        if isinstance(shape, schema.Disk):
            return meshes.disk(shape.radius, shape.inner_radius, shape.phi_max)
        if isinstance(shape, schema.Cylinder):
            return meshes.cylinder(shape.radius, shape.height, shape.phi_max)
        if isinstance(shape, schema.Cone):
            return meshes.cone(shape.radius, shape.height, shape.phi_max)
        if isinstance(shape, schema.Cube):
            return meshes.cube()
        assert isinstance(shape, schema.Mesh), "the others are Mitsuba's own"
        path = self.description.locate(shape.file, f"{where}/file")
        return meshes.read_mesh(path, self.description.where(f"{where}/file"))

    # ------------------------------------------------------------------ materials

    def bsdf(self, material: MaterialPart, where: str) -> BSDFPlugin:
        if material not in self.bsdfs:
            self.bsdfs[material] = self.load(self.plugin(material, where), where)
        return self.bsdfs[material]

    def gather(self) -> None:
        """Merge the materials of spheres and parallelograms that differ only in numbers into one BSDF.

        Meshes are excluded, because Mitsuba merges meshes that share a BSDF into one shape.
        """
        places: dict[MaterialPart, str] = {}
        for index, shape in enumerate(self.description.shapes):
            if shape.material is not None and isinstance(shape, (schema.Sphere, schema.Parallelogram)):
                places.setdefault(shape.material, pointer("scene", "shapes", index, "material"))
        if len(places) < MERGE_FROM:
            return
        from ..transport.fast import by_shape

        groups: dict[Hashable, tuple[Group, list[MaterialPart]]] = {}
        for material, where in places.items():
            plugin = self.plugin(material, where)
            kind = by_shape.structure(plugin)
            if kind is not None:
                group, members = groups.setdefault(kind, (by_shape.Group(plugin), []))
                group.rows.append(dict(by_shape.properties(plugin)))
                members.append(material)
        for group, members in groups.values():
            if len(members) < MERGE_FROM:
                continue
            try:
                bsdf = self.load(group.plugin(self.mi), places[members[0]])
            except InputError:
                continue  # the model takes no textures, or a material is invalid, which is reported when it is built
            if bsdf.placed.model.transmits and bsdf.placed.model.interior is not None:
                continue  # its index of refraction and absorption are also needed apart from its shape
            self.gathered |= {member: (bsdf, group, row) for row, member in enumerate(members)}

    def plugin(self, material: MaterialPart, where: str) -> PluginDict:
        """A material as a dictionary for Mitsuba; errors name `where`, here and in the following methods."""
        plugin: PluginDict = {"type": self.adapter.register_model(self.mi, material.model)}
        # As in the lab, the back sides of surfaces are not black; materials that transmit light ignore this flag.
        plugin["two_sided"] = material.two_sided is not False
        if material.preset is not None:
            plugin["preset"] = material.preset
        parameters = material.model.parameters()
        for name, (value, key, squared) in material.arguments().items():
            here = where + pointer(key)
            if isinstance(value, MaterialPart):
                plugin[name] = self.plugin(value, here)
            elif parameters[name].kind == "file":
                plugin[name] = material.located(str(value), self.description.locate, here)
            elif isinstance(value, (bool, str)):
                plugin[name] = value
            elif parameters[name].kind == "spectrum":
                plugin[name] = self.colour(value, parameters[name], here)
            elif isinstance(value, tuple):
                pair = (self.scalar(item, parameters[name], here, squared) for item in value)
                plugin[f"{name}_x"], plugin[f"{name}_y"] = pair
            else:
                plugin[name] = self.scalar(value, parameters[name], here, squared)
        if material.normalmap is not None:
            plugin = self.normal_mapped(plugin, material.normalmap, f"{where}/normalmap")
        if material.bump is not None:
            plugin = self.bumped(plugin, material.bump, f"{where}/bump")
        return plugin

    def colour(self, value: Value, parameter: Parameter, where: str) -> PluginDict:
        if isinstance(value, ImageTexture):
            pixels = self.values(value, where)
            self.check_range(pixels, parameter, value, where)
            if value.mean:
                return {"type": "rgb", "value": [float(x) for x in np.broadcast_to(pixels.mean((0, 1)), 3)]}
            return textures.bitmap(self.mi, np.broadcast_to(pixels, (*pixels.shape[:2], 3)), value.filter, value.wrap)
        numbers = [*numbers_in(value)]
        return {"type": "rgb", "value": numbers if len(numbers) == 3 else numbers * 3}

    def scalar(self, value: Value, parameter: Parameter, where: str, squared: bool) -> float | PluginDict:
        if isinstance(value, ImageTexture):
            pixels = self.values(value, where).mean(axis=2, keepdims=True)
            pixels = pixels**2 if squared else pixels
            self.check_range(pixels, parameter, value, where)
            if value.mean:
                return float(pixels.mean(dtype=np.float64))
            return textures.bitmap(self.mi, pixels, value.filter, value.wrap)
        (number,) = numbers_in(value)
        return number**2 if squared else number

    def normal_mapped(self, plugin: PluginDict, texture: NormalMap, where: str) -> PluginDict:
        pixels = self.image(texture, where)
        if pixels.shape[2] != 3:
            raise InputError("a one-channel normal map, three expected", self.description.where(where), "use RGB")
        return self.perturbing_normal("normal-map", plugin, slopes(2.0 * pixels - 1.0, texture.scale))

    def bumped(self, plugin: PluginDict, texture: BumpMap, where: str) -> PluginDict:
        """A plugin whose normals are computed from the heights by central differences; the image is repeated."""
        heights = texture.scale * self.image(texture, where).mean(axis=2)
        across, down = ((np.roll(heights, -1, axis) - np.roll(heights, 1, axis)) / 2.0 for axis in (1, 0))
        return self.perturbing_normal("bump", plugin, np.dstack([across * heights.shape[1], down * heights.shape[0]]))

    def perturbing_normal(self, name: str, plugin: PluginDict, values: np.ndarray) -> PluginDict:
        """Nest a plugin in another plugin that perturbs the normal."""
        maps = (textures.bitmap(self.mi, values[..., [axis]], "bilinear", "repeat") for axis in (0, 1))
        perturbed = {"type": self.adapter.plugin_name(name), "base": plugin, "two_sided": plugin["two_sided"]}
        return {**perturbed, **dict(zip(("lean_x", "lean_y"), maps, strict=True))}

    def image(self, texture: ImageTexture | NormalMap | BumpMap, where: str) -> RGB:
        """The values of an image, without the factor."""
        srgb = isinstance(texture, ImageTexture) and texture.color_space == "srgb"
        channel = texture.channel if isinstance(texture, ImageTexture) else None
        path, inside = self.description.locate(texture.file, f"{where}/file"), documents.inside(texture.file)[1]
        key = (path, inside, channel, srgb)
        if key not in self.images:
            here = self.description.where(f"{where}/file")
            self.images[key] = textures.load_image(path, here, srgb=srgb, channel=channel, inside=inside)
        return self.images[key]

    def values(self, texture: ImageTexture, where: str) -> RGB:
        """The values of an image, multiplied by the factor."""
        pixels = self.image(texture, where)
        return pixels if texture.factor == 1.0 else pixels * np.asarray(texture.factor, np.float32)

    def check_range(self, pixels: RGB, parameter: Parameter, texture: ImageTexture, where: str) -> None:
        low, high = float(pixels.min()), float(pixels.max())
        if low < parameter.low or (high > parameter.high and not parameter.soft_high):
            wrong = low if low < parameter.low else high
            raise InputError(
                f"'{texture.file}' holds {wrong:g}, out of range: {parameter.name} is {parameter.range}",
                self.description.where(where),
                "scale the image's values",
            )
        if high > parameter.high:
            self.description._warnings.append(
                f"{self.description.where(where)}: '{texture.file}' holds {high:g}, over {parameter.high:g}: "
                "the material reflects more light than it receives"
            )
