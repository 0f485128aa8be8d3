"""What a picture is made from: by its hashes a checkpoint knows whether anything has changed."""

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
    """What a picture is made from.

    text     writes down the scene as it is rendered, overrides and all; which takes a while where it is large
    files    those that it names, by the name that it gives them
    how      integrator, sampler, seed and what else there is to set
    version  of Gonio and Mitsuba
    device   what computes
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
        """A hash or a name of each thing that the picture depends on, by what a person calls it."""
        identity = {"version": self.version, "code of Gonio": facts.code(), "device": self.device}
        identity |= {"settings": self.how, "scene": _hash(self.text().encode("utf-8", "surrogateescape"))}
        for name, path in self.files.items():
            identity[f"file {name}"] = facts.file_hash(path)
        return identity


def _hash(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def _device(mi: ModuleType) -> str:
    """What computes: another compiler or another processor may round otherwise."""
    variant = str(mi.variant())
    return f"{variant}, {facts.processor() if variant.startswith('llvm') else engine.cuda_device()}"


def check(saved: Facts, identity: Mapping[str, str], where: str) -> None:
    """Raise InputError that names the first thing that is not as it was."""
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
        raise InputError(what, where, "put back what it was, or render anew without this checkpoint")
