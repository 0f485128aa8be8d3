"""Convert metallic-roughness materials of glTF 2.0 with extensions to Gonio materials (Khronos2021, appendix B)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import ClassVar

import numpy as np

from ...errors import InputError
from . import Described, Document, Notation
from .gltf_file import LARGEST, GltfFile, Json

WHITE = (1.0, 1.0, 1.0)
NARROWEST = 2e-3  # smallest alpha under a sheen, because a sum cannot contain mirrors
HIGHEST_INDEX = 3.0  # largest index of refraction of a coat
D_LINE, F_LINE, C_LINE = 0.5876, 0.4861, 0.6563  # um; the spectral lines that define the Abbe number

# Extensions that files may require, because they are supported or do not concern materials
KNOWN = {
    *(
        f"KHR_materials_{name}"
        for name in (
            "anisotropy", "clearcoat", "dispersion", "emissive_strength", "ior", "iridescence", "sheen", "specular",
            "transmission", "unlit", "variants", "volume",
        )
    ),
    "KHR_lights_punctual", "KHR_mesh_quantization", "KHR_node_visibility", "EXT_mesh_gpu_instancing",
}  # fmt: skip
TELLS = "KHR_materials_diffuse_transmission"  # accepted, with a notice that it is not supported


class Gltf(Document):
    """Materials in glTF files (.gltf, .glb)."""

    name: ClassVar[str] = "gltf"
    suffixes: ClassVar[tuple[str, ...]] = (".gltf", ".glb")

    def materials(self, path: Path) -> list[str]:
        return GltfFile(path).material_names()

    def read(self, path: Path, name: str) -> Described:
        file = GltfFile(path)
        return _Material(file, file.material_names().index(name)).described()

    def image(self, path: Path, index: str) -> bytes:
        file = GltfFile(path)
        at = f"/images/{index}"
        if not index.isdecimal() or int(index) >= len(file.items("images")):
            raise InputError(f"no picture '{index}' in this file", f"{path}#{at}")
        image = file.items("images")[int(index)]
        uri = image.get("uri")
        if isinstance(uri, str):
            return file.data(uri, f"{at}/uri")
        return file.view(file.index(image, "bufferView", "bufferViews", at))


class _Material:
    """The conversion of one material of a file.

    As in the specification, the material consists of the following parts, from the bottom up: a dielectric, which is a
    clear layer over a diffuse one, or transmits light; a mix with a metal; a sheen; a clear coat; and holes.
    """

    def __init__(self, file: GltfFile, index: int) -> None:
        self.file, self.at = file, f"/materials/{index}"
        self.own = file.items("materials")[index]
        self.extensions = file.member(self.own, "extensions", self.at)
        self.notices: list[str] = []
        required = file.root.get("extensionsRequired", [])
        if not isinstance(required, list):
            file.fail("a list expected", "/extensionsRequired")
        for name in required:
            if name not in KNOWN:
                hint = "save it without this extension"
                file.fail(f"it requires the extension {str(name)[:60]}, which is not read", "/extensionsRequired", hint)
        for name in self.extensions:
            if name not in KNOWN | {TELLS}:
                self.notices.append(f"the extension {name[:60]} is not supported and is ignored")
        self._read()

    # ------------------------------------------------------------------ reading

    def extension(self, name: str) -> tuple[Json, str]:
        """An extension of the material, which is empty if it is missing, and its location in the file."""
        key = f"KHR_materials_{name}"
        return self.file.member(self.extensions, key, f"{self.at}/extensions"), f"{self.at}/extensions/{key}"

    def _read(self) -> None:
        file, at = self.file, f"{self.at}/pbrMetallicRoughness"
        pbr = file.member(self.own, "pbrMetallicRoughness", self.at)
        *base, self.alpha_factor = file.colour(pbr, "baseColorFactor", (*WHITE, 1.0), at)
        self.base_texture = self.texture(pbr, "baseColorTexture", at, srgb=True)
        self.base = self.coloured(self.base_texture, tuple(base))
        both = self.texture(pbr, "metallicRoughnessTexture", at)
        self.metallic = self.scaled(both, "b", file.number(pbr, "metallicFactor", 1.0, at, 0.0, 1.0))
        self.roughness = self.scaled(both, "g", file.number(pbr, "roughnessFactor", 1.0, at, 0.0, 1.0))

        values, at = self.extension("ior")
        self.index = file.number(values, "ior", 1.5, at, 0.0, LARGEST)
        values, at = self.extension("specular")
        self.specular = file.number(values, "specularFactor", 1.0, at, 0.0, 1.0)
        self.specular_colour = file.colour(values, "specularColorFactor", WHITE, at, LARGEST)
        self.leave(values, at, "specularTexture", "specularColorTexture")
        values, at = self.extension("transmission")
        through = self.texture(values, "transmissionTexture", at)
        self.transmission = self.scaled(through, "r", file.number(values, "transmissionFactor", 0.0, at, 0.0, 1.0))
        values, at = self.extension("volume")
        self.thickness = file.number(values, "thicknessFactor", 0.0, at, 0.0, LARGEST)
        self.distance = (
            file.number(values, "attenuationDistance", math.inf, at, 0.0, LARGEST)
            if ("attenuationDistance" in values)
            else math.inf
        )
        self.attenuation = file.colour(values, "attenuationColor", WHITE, at)
        self.leave(values, at, "thicknessTexture")
        values, at = self.extension("dispersion")
        self.dispersion = file.number(values, "dispersion", 0.0, at, 0.0, LARGEST)
        values, at = self.extension("anisotropy")
        self.anisotropy = file.number(values, "anisotropyStrength", 0.0, at, 0.0, 1.0)
        self.turn = file.number(values, "anisotropyRotation", 0.0, at, -LARGEST, LARGEST)
        self.leave(values, at, "anisotropyTexture")
        values, at = self.extension("iridescence")
        self.iridescence = file.number(values, "iridescenceFactor", 0.0, at, 0.0, 1.0)
        self.film_index = file.number(values, "iridescenceIor", 1.3, at, 1.0, LARGEST)
        file.number(values, "iridescenceThicknessMinimum", 100.0, at, 0.0, LARGEST)
        self.film = file.number(values, "iridescenceThicknessMaximum", 400.0, at, 0.0, LARGEST)
        self.leave(values, at, "iridescenceTexture", "iridescenceThicknessTexture")
        values, at = self.extension("sheen")
        self.sheen = file.colour(values, "sheenColorFactor", (0.0, 0.0, 0.0), at)
        self.sheen_roughness = file.number(values, "sheenRoughnessFactor", 0.0, at, 0.0, 1.0)
        self.leave(values, at, "sheenColorTexture", "sheenRoughnessTexture")
        values, at = self.extension("clearcoat")
        over = self.texture(values, "clearcoatTexture", at)
        self.clearcoat = self.scaled(over, "r", file.number(values, "clearcoatFactor", 0.0, at, 0.0, 1.0))
        self.clearcoat_roughness = file.number(values, "clearcoatRoughnessFactor", 0.0, at, 0.0, 1.0)
        self.leave(values, at, "clearcoatRoughnessTexture", "clearcoatNormalTexture")
        self._rest()

    def _rest(self) -> None:
        """Read properties that are not part of the scattering function or cannot be expressed."""
        file, at = self.file, self.at
        normal = self.texture(self.own, "normalTexture", at)
        scale = file.number(file.member(self.own, "normalTexture", at), "scale", 1.0, at, -LARGEST, LARGEST)
        self.normal = None if normal is None else {"file": normal["file"], **({"scale": scale} if scale != 1.0 else {})}
        self.mode = self.own.get("alphaMode", "OPAQUE")
        if self.mode not in ("OPAQUE", "MASK", "BLEND"):
            file.fail(f"'{str(self.mode)[:20]}' given, OPAQUE, MASK or BLEND expected", f"{at}/alphaMode")
        self.cutoff = file.number(self.own, "alphaCutoff", 0.5, at, 0.0, LARGEST)
        emission = file.colour(self.own, "emissiveFactor", (0.0, 0.0, 0.0), at)
        values, place = self.extension("emissive_strength")
        strength = file.number(values, "emissiveStrength", 1.0, place, 0.0, LARGEST)
        if any(emission) and strength:
            light = ", ".join(f"{strength * part:.4g}" for part in emission)
            self.notices.append(f"it emits [{light}]: Gonio's materials only scatter; give the shape an areaLight")
        self.leave(self.own, at, "occlusionTexture")
        values, place = self.extension("diffuse_transmission")
        if file.number(values, "diffuseTransmissionFactor", 0.0, place, 0.0, 1.0) > 0.0:
            file.colour(values, "diffuseTransmissionColorFactor", WHITE, place)
            self.notices.append("diffuse transmission is not supported: this light is reflected")

    def leave(self, of: Mapping[str, object], at: str, *textures: str) -> None:
        """Add notices about textures that are omitted."""
        for key in textures:
            if self.texture(of, key, at) is not None:
                self.notices.append(f"{key} is omitted: only its factor is used")

    def texture(self, of: Mapping[str, object], key: str, at: str, srgb: bool = False) -> Notation | None:
        """An image in the notation of scenes; None if there is no image."""
        if key not in of:
            return None
        file, at = self.file, f"{at}/{key}"
        info = file.member(of, key, at)
        texture = file.items("textures")[file.index(info, "index", "textures", at)]
        transform = file.member(info, "extensions", at).get("KHR_texture_transform")
        if file.integer(info, "texCoord", at, 0):
            self.notices.append(f"{key} uses a second set of coordinates, and is omitted")
            return None
        if transform:
            self.notices.append(f"{key} is used without its transform")
        if "source" not in texture:
            self.notices.append(f"{key} is omitted: only an extension names its picture")
            return None
        number = file.index(texture, "source", "images", at)
        image = file.items("images")[number]
        image_notation: Notation = {"type": "imageTex", "file": self._picture(image, number)}
        if srgb:
            image_notation["colorSpace"] = "srgb"
        if "sampler" in texture:
            sampler = file.items("samplers")[file.index(texture, "sampler", "samplers", at)]
            if sampler.get("magFilter") == 9728:
                image_notation["filter"] = "nearest"
            if sampler.get("wrapS", 10497) != sampler.get("wrapT", 10497):
                self.notices.append(f"{key} is wrapped along v as along u")
            wrap = {33071: "clamp", 33648: "mirror"}.get(file.integer(sampler, "wrapS", at, 10497))
            if wrap:
                image_notation["wrap"] = wrap
        return image_notation

    def _picture(self, image: Json, number: int) -> str:
        """The file of an image, relative to the glTF file, or FILE#NUMBER if the image is embedded."""
        at, uri = f"/images/{number}", image.get("uri")
        if uri is None:
            self.file.index(image, "bufferView", "bufferViews", at)
            return f"{self.file.path.name}#{number}"
        if not isinstance(uri, str):
            self.file.fail("a string expected", f"{at}/uri")
        if uri.startswith("data:"):
            self.file.data(uri, f"{at}/uri")
            return f"{self.file.path.name}#{number}"
        return self.file.local_file(uri, f"{at}/uri").relative_to(self.file.path.parent.resolve()).as_posix()

    # ------------------------------------------------------------------ values

    def coloured(self, texture: Notation | None, factor: tuple[float, ...]) -> object:
        return list(factor) if texture is None else {**texture, "factor": list(factor)}

    def scaled(self, texture: Notation | None, channel: str, factor: float) -> object:
        return factor if texture is None or not factor else {**texture, "channel": channel, "factor": factor}

    def widths(self, anisotropic: bool = True) -> Notation:
        """`alpha` from the roughness, or the parameter that is given by an image."""
        if isinstance(self.roughness, dict):
            if self.anisotropy:
                self.say("the anisotropy is omitted, since the roughness is a picture")
            return {"roughness": self.roughness}
        alpha = float(self.roughness) ** 2  # type: ignore[arg-type]
        if any(self.sheen):
            alpha = max(alpha, NARROWEST)
        if not self.anisotropy or not anisotropic:
            return {"alpha": alpha}
        along = alpha + (1.0 - alpha) * self.anisotropy**2
        rotation = {"rotation": math.remainder(self.turn, math.tau)} if self.turn else {}
        return {"alpha": [along, alpha], **rotation}

    def say(self, notice: str) -> None:
        if notice not in self.notices:
            self.notices.append(notice)

    # ------------------------------------------------------------------ layers

    def described(self) -> Described:
        if "KHR_materials_unlit" in self.extensions:
            self.say("it is unlit, displayed without lighting: here it is a matte surface of that color")
            notation: Notation = {"type": "lambert", "albedo": self.base}
        else:
            notation = self._coated(self._sheened(self._body()))
        notation = self._holed(notation)
        if self.normal is not None:
            notation["normalmap"] = self.normal
        return Described(notation, tuple(self.notices))

    def _body(self) -> Notation:
        metallic, through = self.metallic, self.transmission
        if metallic == 1.0:
            return self._metal()
        dielectric = self._opaque() if through == 0.0 else self._clear()
        if isinstance(through, dict) or 0.0 < float(through) < 1.0:  # type: ignore[arg-type]
            dielectric = _mixed(self._opaque(), dielectric, through)
        return dielectric if metallic == 0.0 else _mixed(dielectric, self._metal(), metallic)

    def _metal(self) -> Notation:
        plain: Notation = {"type": "metal", "r0": self.base, **self.widths()}
        if not self.iridescence:
            return plain
        if isinstance(self.base, dict):
            self.say("the film is omitted, since its metal's color is a picture")
            return plain
        # only the reflectance of a metal is given, so its index has no absorption, as in the specification
        roots = [math.sqrt(min(r, 0.9999)) for r in self.base]  # type: ignore[attr-defined]
        filmed: Notation = {"type": "film-conductor", "eta": [(1.0 + r) / (1.0 - r) for r in roots], "k": 0.0}
        filmed |= {**self.widths(), **self._film()}
        return filmed if self.iridescence == 1.0 else _mixed(plain, filmed, self.iridescence)

    def _film(self) -> Notation:
        if self.film > 3000.0 or self.film_index > HIGHEST_INDEX:
            self.say("the film is limited to 3000 nm and an index of 3")
        return {"thickness": min(self.film, 3000.0), "film_eta": min(self.film_index, HIGHEST_INDEX)}

    def _opaque(self) -> Notation:
        """A clear layer over a diffuse one, whose color is the color of the layered material."""
        if self.iridescence:
            self.say("the film is omitted over the diffuse part")
        matt: Notation = {"type": "lambert", "albedo": self.base}
        index = self._index()
        if index - 1.0 < 1e-4:
            return matt
        if isinstance(self.roughness, dict):
            alpha: object = {**self.roughness, "mean": True}
            self.say("the clear layer has one roughness, the picture's mean: its tables are for one width")
        else:
            alpha = self.roughness
            if self.anisotropy:
                self.say("the anisotropy is omitted over the diffuse part")
        width: Notation = {"roughness": alpha} if isinstance(alpha, dict) else self.widths(anisotropic=False)
        return {"type": "coat", "base": matt, "index": index, "bounces": "white", **width}

    def _index(self) -> float:
        """The index of refraction whose normal reflectance is that of ior and specular combined."""
        grey = sum(self.specular_colour) / 3.0
        if len(set(self.specular_colour)) > 1:
            self.say("specularColorFactor is replaced by its mean: a clear layer reflects without color")
        if self.index == 0.0:
            r0 = 1.0
        elif self.index < 1.0:
            self.file.fail(
                f"ior {self.index:g} given, 0, or 1 or more expected", f"{self.at}/extensions/KHR_materials_ior"
            )
        else:
            r0 = ((self.index - 1.0) / (self.index + 1.0)) ** 2
        r0 = min(r0 * grey, 1.0) * self.specular
        root = math.sqrt(r0)
        index = (1.0 + root) / max(1.0 - root, 1e-6)
        if self.specular < 1.0 and r0 > 0.0:
            self.say("specularFactor is replaced by a lower index: at grazing angles all light is still reflected")
        if index > HIGHEST_INDEX:
            self.say(f"the index {index:.3g} is limited to {HIGHEST_INDEX:g}")
        return min(index, HIGHEST_INDEX)

    def _clear(self) -> Notation:
        """Glass: a solid if the material has a volume, otherwise a thin sheet."""
        index = self._index()
        tint = {} if self.base == list(WHITE) else {"albedo": self.base}
        if tint:
            self.say("the base color of the transmitting part tints its reflection too")
        if not self.thickness:
            if self.roughness != 0.0:
                self.say("a thin sheet is smooth: its roughness is omitted")
            return {"type": "thin-dielectric", "eta": index, **tint}
        glass: Notation = {"type": "dielectric", "eta": self._dispersing(index), **tint, **self.widths()}
        if self.iridescence:
            glass = {**glass, "type": "film-dielectric", **self._film()}
        if math.isfinite(self.distance) and self.distance > 0.0:
            dark = [max(-math.log(max(part, 1e-6)), 0.0) / self.distance for part in self.attenuation]
            glass["absorption"] = dark
        return glass

    def _dispersing(self, index: float) -> object:
        """Cauchy's formula with the given index at 587.6 nm and the Abbe number V = 20 / dispersion."""
        if not self.dispersion or self.iridescence:
            if self.dispersion:
                self.say("the dispersion is omitted under a film")
            return index
        b = (index - 1.0) * self.dispersion / 20.0 / (F_LINE**-2 - C_LINE**-2)
        return f"cauchy({index - b / D_LINE**2:.9g}, {b:.9g})"

    def _sheened(self, body: Notation) -> Notation:
        """The material under a sheen; the layers below receive the average light that the sheen does not reflect."""
        if not any(self.sheen):
            return body
        alpha = self.sheen_roughness**2
        if alpha < ALBEDOS[0][0]:
            alpha = ALBEDOS[0][0]
            self.say(f"the sheen's roughness is limited to {math.sqrt(alpha):.2g}, below which its model gains energy")
        transmitted = 1.0 - max(self.sheen) * float(np.interp(alpha, *ALBEDOS))
        below = _mixed({"type": "lambert", "albedo": 0.0}, body, transmitted)
        return {"type": "sum", "a": {"type": "sheen-charlie", "albedo": list(self.sheen), "alpha": alpha}, "b": below}

    def _coated(self, body: Notation) -> Notation:
        if self.clearcoat == 0.0:
            return body
        if self.transmission != 0.0:
            self.say("the clear coat is omitted: a coat's base must not transmit")
            return body
        alpha = self.clearcoat_roughness**2
        coated: Notation = {"type": "coat", "base": body, "index": 1.5, "alpha": alpha, "bounces": "white"}
        return coated if self.clearcoat == 1.0 else _mixed(body, coated, self.clearcoat)

    def _holed(self, body: Notation) -> Notation:
        if self.mode == "OPAQUE":
            return body
        opacity: object = self.alpha_factor
        if self.base_texture is not None:
            opacity = {**self.base_texture, "colorSpace": "raw", "channel": "a", "factor": self.alpha_factor}
            if self.mode == "MASK":
                self.say("the mask's edge is soft: alphaCutoff cannot be expressed")
        elif self.mode == "MASK":
            opacity = 1.0 if self.alpha_factor >= self.cutoff else 0.0
        if opacity == 1.0:
            return body
        both = body if self.transmission != 0.0 else {"type": "two-sided", "base": body}
        return {"type": "opacity", "base": both, "opacity": opacity}


def _mixed(a: Notation, b: Notation, weight: object) -> Notation:
    return {"type": "mix", "a": a, "b": b, "weight": weight}


# (alpha, albedo under uniform illumination) of a white `sheen-charlie`, computed with go.albedo
ALBEDOS = (
    (0.07, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0),
    (0.0624, 0.0777, 0.1010, 0.1226, 0.1615, 0.1954, 0.2244, 0.2486, 0.2681, 0.2830, 0.2934, 0.2996),
)
