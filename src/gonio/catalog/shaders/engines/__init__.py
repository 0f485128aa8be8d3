"""Adapters to the shaders of rendering engines, one folder per engine. The folders contain no code of the engines.

    adopt_package("node_modules/three", "three")     writes three-standard.glsl, its adapter, and the tables it reads

A shader of Gonio includes the chunks of the package and calls its functions; `package/` in an adapter denotes the
folder of the package. The module in an engine's folder names the package (`PACKAGE`) and reads its tables (`tables`).
An engine that is not on npm is recognized by a file in its repository (`MARK`). `replaced` returns replacements for
words in the adapters that depend on the release, such as the arguments of a function. If the JavaScript of an engine
generates its shaders, they are obtained by running it (`generated`), but only on request.
"""

from __future__ import annotations

import importlib
import io
import json
import os
import pkgutil
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from .... import files
from ....errors import InputError

MAX_DESCRIPTION = 1 << 20  # maximum size of a package.json in bytes


class Engine(NamedTuple):
    """An engine: the name of its package on npm, Gonio's shaders for it, and its tables by file name.

    mark       for an engine that is not on npm: a file in its repository by which a checkout is recognized
    replaced   replacements for words in the adapters that depend on the content of the package
    generated  for an engine whose JavaScript generates shaders: the shaders and their adapters by file name
    """

    package: str
    folder: Path
    tables: Callable[[Path], dict[str, np.ndarray]]
    mark: str
    replaced: Callable[[Path], dict[str, str]]
    generated: Callable[[Path], dict[str, str]] | None


class Package(NamedTuple):
    """A package of the user: its name and version, from its package.json, and its folder.

    A checkout has the name of the engine and no version.
    """

    name: str
    version: str
    folder: Path


def engines() -> dict[str, Engine]:
    """All supported engines, by the names of their packages."""
    modules = [importlib.import_module(f"{__name__}.{one.name}") for one in pkgutil.iter_modules(__path__)]
    return {
        one.PACKAGE: Engine(
            one.PACKAGE,
            Path(one.__path__[0]),
            one.tables,
            getattr(one, "MARK", ""),
            getattr(one, "replaced", lambda package: {}),
            getattr(one, "generated", None),
        )
        for one in modules
    }


def package_in(folder: str | os.PathLike[str]) -> Package:
    """The package or checkout of an engine in a folder. Raises InputError if there is none."""
    place = Path(os.path.expanduser(folder))
    for engine in engines().values():
        if engine.mark and (place / engine.mark).is_file():
            return Package(engine.package, "", place)
    path = place / "package.json"
    hint = f"give the folder of {', '.join(engines())}, such as node_modules/three"
    try:
        if path.stat().st_size > MAX_DESCRIPTION:
            raise InputError(f"larger than {MAX_DESCRIPTION >> 20} MB", str(path), hint)
        about = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"its package.json cannot be read: {error.strerror}", str(folder), hint) from None
    except (ValueError, RecursionError) as error:
        raise InputError(f"its package.json is not valid JSON: {error}", str(folder), hint) from None
    name = about.get("name") if isinstance(about, dict) else None
    if name not in engines():
        raise InputError(f"no adapter for the package '{name}'", str(folder), hint)
    return Package(name, str(about.get("version", "")), path.parent)


def adopt_package(folder: str | os.PathLike[str], target: str | os.PathLike[str], *, tsl: bool = False) -> list[Path]:
    """Write the materials of an engine's package to a folder, each as a .glsl or .wgsl file with its adapter.

    folder  the package as installed by npm, such as node_modules/three, or a checkout of an engine that is not on npm.
            It is read again whenever a material is used
    target  the folder to write, which is created if it is missing; the shaders refer to the package by relative paths
    tsl     whether to add the materials of three.js's TSL build, for which Node runs the JavaScript of the package.
            They are snapshots, which do not change if the package changes
    Returns the shaders, one per material. Raises InputError if Gonio has no adapters for the package, or if its TSL
    build is missing or cannot be read, and MachineError if Node is not installed.
    """
    package = package_in(folder)
    engine = engines()[package.name]
    place = Path(target)
    words = engine.replaced(package.folder)
    tables = engine.tables(package.folder)
    if tsl and engine.generated is None:
        raise InputError(f"'{package.name}' has no TSL build", "--tsl", "only three has one")
    generated = engine.generated(package.folder) if tsl and engine.generated else {}
    there = os.path.relpath(package.folder.resolve(), place.resolve()).replace(os.sep, "/")
    place.mkdir(parents=True, exist_ok=True)
    for source in _programs(engine.folder):
        text = source.read_text(encoding="utf-8")
        if source.suffix == ".toml":
            for old, new in {'"package/': f'"{there}/', **words}.items():
                text = text.replace(old, new)
        files.write_whole(place / source.name, text.encode())
    for name, text in generated.items():
        files.write_whole(place / name, text.encode())
    for name, table in tables.items():
        data = io.BytesIO()
        np.save(data, table, allow_pickle=False)
        files.write_whole(place / f"{name}.npy", data.getvalue())
    written = [*(one.name for one in _programs(engine.folder)), *sorted(generated)]
    return [place / name.removesuffix(".toml") for name in written if name.endswith(".toml")]


def _programs(folder: Path) -> list[Path]:
    """Gonio's shaders and adapters in the folder of an engine."""
    return sorted(one for one in folder.iterdir() if one.is_file() and one.suffix != ".py")
