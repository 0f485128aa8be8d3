"""A validated glTF 2.0 file: .gltf with its external files, or .glb (Khronos2021, sec. 4).

All content is untrusted: stated sizes are compared to actual sizes, indices are compared to the lengths of lists, and
external files must be in the folder of the file.
"""

from __future__ import annotations

import base64
import binascii
import json
import struct
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import NoReturn, TypeAlias
from urllib.parse import unquote

from ...errors import InputError

Json: TypeAlias = "dict[str, object]"

MAX_BYTES = 1 << 30  # maximum size of a file; a larger one is not plausible for materials
MOST_JSON = 64 << 20
MOST_ITEMS = 1_000_000  # maximum length of a list, so that a check takes at most a second
LARGEST = 1e18  # the limit of numbers in scenes
_JSON, _BIN = 0x4E4F534A, 0x004E4942
_SIZES = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}
_PARTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}


class GltfFile:
    """A glTF file, which is validated on construction.

    path  path of the file
    root  the JSON object in the file
    """

    def __init__(self, path: Path) -> None:
        self.path, self._where = path, str(path)
        data = self._bytes_of(path)
        self._chunk: bytes | None = None
        self._lists: dict[str, list[Json]] = {}
        if data[:4] == b"glTF" or path.suffix.lower() == ".glb":
            text, self._chunk = self._chunks(data)
        else:
            text = data
        self.root = self._parsed(text)
        self._check()

    # ------------------------------------------------------------------ access to the JSON

    def fail(self, what: str, at: str = "", hint: str = "") -> NoReturn:
        """Raise InputError for a location in the file."""
        raise InputError(what, f"{self._where}#{at}" if at else self._where, hint)

    def items(self, key: str) -> list[Json]:
        """The list of objects under a key at the top level; empty if it is missing."""
        if key not in self._lists:
            items = self.root.get(key, [])
            if not isinstance(items, list) or not all(isinstance(item, dict) for item in items):
                self.fail("a list of objects expected", f"/{key}")
            self._lists[key] = items
        return self._lists[key]

    def material_names(self) -> list[str]:
        """The name of each material if it is unique, else its number."""
        given = [str(material.get("name", "")) for material in self.items("materials")]
        unique = {name for name, times in Counter(given).items() if name and times == 1 and not name.isdigit()}
        return [name if name in unique else str(index) for index, name in enumerate(given)]

    def member(self, of: Mapping[str, object], key: str, at: str) -> Json:
        """A member that is an object; empty if it is missing. `at` is the location of `of` in the file."""
        member = of.get(key, {})
        if not isinstance(member, dict):
            self.fail("an object expected", f"{at}/{key}")
        return member

    def number(self, of: Mapping[str, object], key: str, default: float, at: str, low: float, high: float) -> float:
        """A member that is a number from `low` to `high`."""
        number = of.get(key, default)
        if isinstance(number, bool) or not isinstance(number, int | float):
            self.fail("a number expected", f"{at}/{key}")
        if not low <= number <= high:  # an integer of a thousand digits can be compared but not printed
            self.fail(f"{str(number)[:20]} is out of range: {low:g} to {high:g} expected", f"{at}/{key}")
        return float(number)

    def colour(
        self, of: Mapping[str, object], key: str, default: tuple[float, ...], at: str, high: float = 1.0
    ) -> tuple[float, ...]:
        """A member that is a list of numbers from 0 to `high`, with the same length as the default."""
        color = of.get(key, list(default))
        if not isinstance(color, list) or len(color) != len(default):
            self.fail(f"a list of {len(default)} numbers expected", f"{at}/{key}")
        return tuple(self.number({str(i): part}, str(i), 0.0, f"{at}/{key}", 0.0, high) for i, part in enumerate(color))

    def integer(
        self, of: Mapping[str, object], key: str, at: str, default: int | None = None, high: int = 1 << 40
    ) -> int:
        """A member that is an integer from 0 to `high`. Raises InputError if it is missing and there is no default."""
        number = of.get(key, default)
        if isinstance(number, bool) or not isinstance(number, int) or number < 0:
            self.fail("a whole number of 0 or more expected", f"{at}/{key}")
        if number > high:
            self.fail(f"{str(number)[:20]} given, at most {high} expected", f"{at}/{key}")
        return number

    def index(self, of: Mapping[str, object], key: str, into: str, at: str) -> int:
        """A member that is an index into a list at the top level."""
        count = len(self.items(into))
        number = self.integer(of, key, at)
        if number >= count:
            self.fail(f"there is no {into} {number}: the file has {count}", f"{at}/{key}")
        return number

    # ------------------------------------------------------------------ bytes

    def view(self, index: int) -> bytes:
        """The bytes of a buffer view, which `_check` has validated."""
        view = self.items("bufferViews")[index]
        at = f"/bufferViews/{index}"
        data = self._buffer(self.index(view, "buffer", "buffers", at))
        start = self.integer(view, "byteOffset", at, 0)
        return data[start : start + self.integer(view, "byteLength", at)]

    def local_file(self, uri: str, at: str) -> Path:
        """The file at a relative URI. Raises InputError if the file is outside the folder or does not exist."""
        hint = "put the file into the same folder, or embed the data"
        if ":" in uri.split("/")[0] or uri.startswith(("//", "\\")):
            self.fail(f"'{uri[:60]}' is not a file in its folder", at, hint)
        try:
            folder = self.path.parent.resolve()
            path = (folder / unquote(uri)).resolve()
            inside, there = path.is_relative_to(folder), path.is_file()
        except (OSError, ValueError, RuntimeError) as error:  # too long a name, a zero byte, or circular links
            self.fail(f"not a usable file name: {error}", at, hint)
        if not inside:
            self.fail(f"'{uri[:60]}' is outside its folder", at, hint)
        if not there:
            self.fail(f"'{uri[:60]}' does not exist", at, "keep a .gltf together with its files, or use .glb")
        return path

    def data(self, uri: str, at: str) -> bytes:
        """The content of a data URI."""
        head, comma, text = uri.partition(",")
        if not comma or not head.endswith(";base64"):
            self.fail("a data URI without ';base64,'", at)
        try:
            return base64.b64decode(text, validate=True)
        except (binascii.Error, ValueError):
            self.fail("its data is not valid base64", at)

    def _buffer(self, index: int) -> bytes:
        buffer, at = self.items("buffers")[index], f"/buffers/{index}"
        uri = buffer.get("uri")
        if uri is None:
            if index or self._chunk is None:
                self.fail("a buffer without data", at)
            return self._chunk
        if not isinstance(uri, str):
            self.fail("a string expected", f"{at}/uri")
        if uri.startswith("data:"):
            return self.data(uri, f"{at}/uri")
        return self._bytes_of(self.local_file(uri, f"{at}/uri"))

    def _size(self, index: int) -> int:
        """The actual number of bytes in a buffer, determined without reading external files."""
        uri = self.items("buffers")[index].get("uri")
        if isinstance(uri, str) and not uri.startswith("data:"):
            return self.local_file(uri, f"/buffers/{index}/uri").stat().st_size
        return len(self._buffer(index))

    def _bytes_of(self, path: Path) -> bytes:
        try:
            size = path.stat().st_size
            if size > MAX_BYTES:
                raise InputError(f"{size} bytes, at most {MAX_BYTES} expected", str(path))
            return path.read_bytes()
        except OSError as error:
            raise InputError(f"cannot be read: {error.strerror or error}", str(path)) from None

    def _chunks(self, data: bytes) -> tuple[bytes, bytes | None]:
        """The JSON chunk and the binary chunk of a .glb file."""
        if len(data) < 20 or data[:4] != b"glTF":
            self.fail("not a glTF file: its first 20 bytes are not a .glb header")
        version, length = struct.unpack_from("<II", data, 4)
        if version != 2:
            self.fail(f"version {version} of .glb, 2 expected", hint="save it as glTF 2.0")
        if length != len(data):
            self.fail(f"its header states {length} bytes, but it has {len(data)}", hint="it is truncated or damaged")
        chunks: dict[int, bytes] = {}
        at = 12
        while at < length:
            if at + 8 > length:
                self.fail(f"a chunk's header is truncated at byte {at}")
            size, kind = struct.unpack_from("<II", data, at)
            if size > length - at - 8:
                self.fail(f"a chunk of {size} bytes at byte {at}, where {length - at - 8} are left")
            chunks.setdefault(kind, data[at + 8 : at + 8 + size])
            at += 8 + size
        if _JSON not in chunks:
            self.fail("the .glb contains no JSON")
        return chunks[_JSON], chunks.get(_BIN)

    # ------------------------------------------------------------------ checks

    def _parsed(self, text: bytes) -> Json:
        if len(text) > MOST_JSON:
            self.fail(f"{len(text)} bytes of JSON, at most {MOST_JSON} expected")

        def no_number(name: str) -> NoReturn:
            raise ValueError(f"{name} is not a JSON number")

        try:
            root = json.loads(text.decode("utf-8-sig"), parse_constant=no_number)
        except RecursionError:
            self.fail("its JSON is nested too deeply")
        except ValueError as error:  # includes invalid UTF-8, and integers with more digits than Python can convert
            self.fail(f"not valid JSON: {str(error)[:200]}", hint="it is truncated or damaged")
        if not isinstance(root, dict):
            self.fail("an object expected", "/")
        return root

    def _check(self) -> None:
        version = self.member(self.root, "asset", "").get("version")
        if not isinstance(version, str) or not version.startswith("2."):
            what = "no asset.version" if version is None else f"version {str(version)[:20]}"
            self.fail(f"{what}, 2.0 expected", "/asset", "save it as glTF 2.0")
        for key, value in self.root.items():
            if isinstance(value, list) and len(value) > MOST_ITEMS:
                self.fail(f"{len(value)} entries, at most {MOST_ITEMS} expected", f"/{key}")
        sizes = self._buffers()
        for index, view in enumerate(self.items("bufferViews")):
            at = f"/bufferViews/{index}"
            end = self.integer(view, "byteOffset", at, 0) + self.integer(view, "byteLength", at)
            size = sizes[self.index(view, "buffer", "buffers", at)]
            if end > size:
                self.fail(f"it ends at byte {end} of a buffer of {size} bytes", at, "it is truncated or damaged")
        for index, accessor in enumerate(self.items("accessors")):
            self._accessor(accessor, f"/accessors/{index}")
        self._nodes()

    def _buffers(self) -> list[int]:
        sizes = []
        for index, buffer in enumerate(self.items("buffers")):
            claimed, size = self.integer(buffer, "byteLength", f"/buffers/{index}"), self._size(index)
            if claimed > size:
                what = f"a buffer of {claimed} bytes, but there are {size}"
                self.fail(what, f"/buffers/{index}/byteLength", "it is truncated or damaged")
            sizes.append(claimed)
        return sizes

    def _accessor(self, accessor: Json, at: str) -> None:
        size, parts = _SIZES.get(self.integer(accessor, "componentType", at)), _PARTS.get(str(accessor.get("type")))
        if size is None or parts is None:
            self.fail("unknown componentType or type", at)
        count = self.integer(accessor, "count", at)
        if "bufferView" not in accessor:
            return
        view = self.items("bufferViews")[self.index(accessor, "bufferView", "bufferViews", at)]
        element = size * parts
        stride = self.integer(view, "byteStride", at, 0, 252) or element
        end = self.integer(accessor, "byteOffset", at, 0) + (stride * (count - 1) + element if count else 0)
        if end > self.integer(view, "byteLength", at):
            self.fail(f"{count} entries end at byte {end} of a view of {view['byteLength']}", at)

    def _nodes(self) -> None:
        """Check that every node has at most one parent, and that no node is its own ancestor."""
        nodes = self.items("nodes")
        parent: dict[int, int] = {}
        for index, node in enumerate(nodes):
            at = f"/nodes/{index}/children"
            children = node.get("children", [])
            if not isinstance(children, list):
                self.fail("a list expected", at)
            for place, child in enumerate(children):
                number = self.index({str(place): child}, str(place), "nodes", at)
                if number in parent:
                    self.fail(f"node {number} has two parents", at)
                parent[number] = index
        rooted: set[int] = set()
        for start in range(len(nodes)):
            chain: set[int] = set()
            here: int | None = start
            while here is not None and here not in rooted:
                if here in chain:
                    self.fail(f"node {here} is its own ancestor", f"/nodes/{here}", "nodes must form a tree")
                chain.add(here)
                here = parent.get(here)
            rooted |= chain
