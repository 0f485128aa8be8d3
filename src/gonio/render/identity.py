"""The inputs on which a picture depends, with hashes that reveal whether they have changed since a checkpoint."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

from ..bridge import engine
from ..errors import InputError
from ..work import facts
from ..work.kept import Facts


@dataclass(frozen=True)
class Sources:
    """The inputs on which a picture depends.

    text     a function that returns the scene, including overrides, as text; slow for large scenes
    files    the files that the scene uses, by their names in the scene
    how      integrator, sampler, seed and all other settings, as text
    version  versions of Gonio, Mitsuba and Dr.Jit
    device   name of the processor or GPU, and its compiler
    """

    text: Callable[[], str]
    files: Mapping[str, Path]
    how: str
    version: str
    device: str

    @staticmethod
    def of(mi: ModuleType, text: Callable[[], str], files: Mapping[str, Path], how: str) -> Sources:
        return Sources(text, files, how, facts.versions(), _device(mi))

    def identity(self) -> dict[str, str]:
        """A hash or description of each input, by its name in errors."""
        identity = {"version": self.version, "code of Gonio": facts.code(), "device": self.device}
        identity |= {"settings": self.how, "scene": _hash(self.text().encode("utf-8", "surrogateescape"))}
        for name, path in self.files.items():
            identity[f"file {name}"] = facts.file_hash(path)
        return identity


def _hash(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def _device(mi: ModuleType) -> str:
    """The device and its compiler, because another processor or compiler may round differently."""
    variant = str(mi.variant())
    return f"{variant}, {facts.processor() if variant.startswith('llvm') else engine.cuda_device()}"


def check(saved: Facts, identity: Mapping[str, str], where: str) -> None:
    """Raise InputError, which names the first changed input, if an input has changed since the checkpoint was written.

    saved     the facts in the checkpoint
    identity  the current hashes and descriptions of the inputs
    where     path of the checkpoint
    """
    before = saved.get("identity")
    before = before if isinstance(before, dict) else {}
    for name in [*identity, *before]:
        old, new = before.get(name), identity.get(name)
        if old == new:
            continue
        if name in ("version", "device", "settings"):
            what = f"{name}: the checkpoint was made with {old}, this is {new}"
        elif name == "code of Gonio":
            what = "the code of Gonio has changed since the checkpoint was made"
        elif new == "missing":
            what = f"the {name} is no longer there"
        else:
            what = f"the {name} has changed since the checkpoint was made"
        raise InputError(what, where, "restore it, or render again without this checkpoint")
