"""Small glTF files, for tests and as seeds of the fuzzer."""

from __future__ import annotations

import base64
import json
import struct
import zlib
from typing import Any

import numpy as np

ALL: dict[str, dict[str, Any]] = {
    "Plain": {},
    "Red": {
        "pbrMetallicRoughness": {"baseColorFactor": [0.8, 0.1, 0.1, 1], "metallicFactor": 0, "roughnessFactor": 0.4}
    },
    "Glass": {
        "pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 0},
        "extensions": {
            "KHR_materials_transmission": {"transmissionFactor": 1},
            "KHR_materials_volume": {
                "thicknessFactor": 1,
                "attenuationDistance": 2,
                "attenuationColor": [0.5, 1, 1],
            },
            "KHR_materials_dispersion": {"dispersion": 0.4},
            "KHR_materials_ior": {"ior": 1.6},
        },
    },
    "Cloth": {
        "pbrMetallicRoughness": {"metallicFactor": 0},
        "extensions": {"KHR_materials_sheen": {"sheenColorFactor": [0.5, 0.4, 0.4], "sheenRoughnessFactor": 0.5}},
    },
    "Car": {
        "pbrMetallicRoughness": {"metallicFactor": 0.5, "roughnessFactor": 0.5},
        "extensions": {"KHR_materials_clearcoat": {"clearcoatFactor": 1, "clearcoatRoughnessFactor": 0.1}},
    },
    "Oil": {
        "pbrMetallicRoughness": {"baseColorFactor": [0.9, 0.8, 0.6, 0.5], "roughnessFactor": 0.3},
        "alphaMode": "BLEND",
        "extensions": {
            "KHR_materials_iridescence": {"iridescenceFactor": 1, "iridescenceThicknessMaximum": 350},
            "KHR_materials_anisotropy": {"anisotropyStrength": 0.5, "anisotropyRotation": 1},
        },
    },
    "Sheet": {
        "pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 0},
        "extensions": {
            "KHR_materials_transmission": {"transmissionFactor": 0.5},
            "KHR_materials_specular": {"specularFactor": 0.5},
        },
    },
    "Sign": {"emissiveFactor": [1, 0, 0], "extensions": {"KHR_materials_unlit": {}}},
}


def document(materials: dict[str, dict[str, Any]] | None = None, **more: Any) -> dict[str, Any]:
    """A file of materials by name, and whatever stands beside them."""
    named = [{"name": name, **material} for name, material in (ALL if materials is None else materials).items()]
    return {"asset": {"version": "2.0"}, "materials": named, **more}


def text(content: dict[str, Any]) -> bytes:
    return json.dumps(content).encode()


def glb(content: dict[str, Any], chunk: bytes = b"") -> bytes:
    """The same as one binary file."""
    words = text(content)
    words += b" " * (-len(words) % 4)
    chunk += b"\0" * (-len(chunk) % 4)
    body = struct.pack("<II", len(words), 0x4E4F534A) + words
    if chunk:
        body += struct.pack("<II", len(chunk), 0x004E4942) + chunk
    return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body


def glb_repaired(data: bytes) -> bytes:
    """The length that a file claims set right, so that what is inside gets read."""
    return data[:8] + struct.pack("<I", len(data)) + data[12:] if data[:4] == b"glTF" and len(data) >= 12 else data


def png(values: np.ndarray) -> bytes:
    """A picture, (height, width, 3 or 4) of whole numbers."""
    height, width, channels = values.shape

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = struct.pack(">IIBBBBB", width, height, 8, {3: 2, 4: 6}[channels], 0, 0, 0)
    rows = b"".join(b"\0" + row.astype(np.uint8).tobytes() for row in values)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


def pictured() -> tuple[dict[str, Any], bytes]:
    """A material whose values are pictures inside the file: colour and alpha, roughness (G) and metallic (B)."""
    colour = np.full((2, 4, 4), (188, 128, 0, 255))
    colour[:, 2:, 3] = 0
    both = np.full((2, 4, 3), (9, 128, 255))
    parts = [png(colour), png(both)]
    sizes = [len(part) for part in parts]
    views = [
        {"buffer": 0, "byteOffset": 0, "byteLength": sizes[0]},
        {"buffer": 0, "byteOffset": sizes[0], "byteLength": sizes[1]},
    ]
    metallic = {
        "baseColorTexture": {"index": 0},
        "baseColorFactor": [1, 0.5, 1, 1],
        "metallicRoughnessTexture": {"index": 1},
        "roughnessFactor": 0.5,
    }
    content = document(
        {"Tiles": {"pbrMetallicRoughness": metallic, "alphaMode": "BLEND"}},
        images=[{"bufferView": 0, "mimeType": "image/png"}, {"bufferView": 1, "mimeType": "image/png"}],
        textures=[{"source": 0, "sampler": 0}, {"source": 1}],
        samplers=[{"magFilter": 9728, "wrapS": 33071, "wrapT": 33071}],
        bufferViews=views,
        buffers=[{"byteLength": sum(sizes)}],
    )
    return content, b"".join(parts)


def meshed() -> dict[str, Any]:
    """A triangle in a tree of nodes, as files with materials mostly have."""
    points = np.array([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], "<f4").tobytes()
    return document(
        {"Red": ALL["Red"]},
        scene=0,
        scenes=[{"nodes": [0]}],
        nodes=[{"children": [1]}, {"mesh": 0}],
        meshes=[{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}],
        accessors=[{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        bufferViews=[{"buffer": 0, "byteLength": 36}],
        buffers=[
            {"byteLength": 36, "uri": "data:application/octet-stream;base64," + base64.b64encode(points).decode()}
        ],
    )
