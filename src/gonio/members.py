"""Registries of members: materials, distributions, laws, commands and other families.

A member is added in one of three ways; there is no central list to edit:

    a file in the family's folder                       all members in `src/gonio`
    an entry point of an installed package              [project.entry-points."gonio.models"]  ward = "mypackage:Ward"
    a call of `go.register(Ward)`, also as a decorator

Names are unique within a family. Adding a member under an existing name is an error, with two exceptions: the existing
member is `overridable` (Gonio's historic models, whose names users are likely to choose), or the new member is the same
class, loaded again from its file.
"""

from __future__ import annotations

import contextlib
import importlib
import os
import pkgutil
import sys
import warnings
from collections.abc import Callable, Iterable
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Generic, TypeVar

from . import garbage
from .arguments import shown
from .errors import GonioWarning, InputError, did_you_mean

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

Member = TypeVar("Member")


def with_article(kind: str) -> str:
    """The kind of a member with its article: "a material", "an integrator"."""
    return f"{'an' if kind[0] in 'aeiou' else 'a'} {kind}"


class Family(Generic[Member]):
    """The members of one family, by name.

    kind     the noun for a member in error messages, such as "material"
    group    the entry-point group, such as "gonio.models"
    folders  packages whose modules define members; imported on first use
    member   maps an object of a module or entry point to (name, member), or to None if the object is not a member
    where    the location in errors about unknown names
    """

    def __init__(
        self,
        kind: str,
        group: str,
        folders: Iterable[str] | Callable[[], Iterable[str]],
        member: Callable[[object], tuple[str, Member] | None],
        where: str = "",
    ) -> None:
        self.kind, self.group, self.where = kind, group, where or kind
        self._folders, self._member = folders, member
        self._shipped: dict[str, Member] | None = None
        self._added: dict[str, Member] = {}
        self._announced_names: set[str] = set()  # names of members from installed packages
        self._watchers: dict[Callable[[str, Member], None], None] = {}

    def all(self) -> dict[str, Member]:
        """Every member by name, in alphabetical order."""
        if self._shipped is None:
            folders = self._folders() if callable(self._folders) else self._folders
            self._shipped = dict(pair for folder in folders for pair in self._in_package(folder))
            for point in _entry_points(self.group):
                self._announced(point)
        return dict(sorted({**self._shipped, **self._added}.items()))

    def get(self, name: str, where: str = "") -> Member:
        """The member with a given name. Raises InputError, which suggests the closest known name, if there is none.

        where  the location that the error names; that of the family if empty
        """
        if self._shipped is None:
            self.all()
        if not isinstance(name, str):
            raise InputError(f"{shown(name)} is not a name", where or self.where, "give the name of a " + self.kind)
        for known in (self._added, self._shipped or {}):  # called at every evaluation, so nothing is sorted here
            if name in known:
                return known[name]
        raise InputError(f"unknown {self.kind} '{name}'", where or self.where, did_you_mean(name, list(self.all())))

    def titles(self) -> dict[str, str]:
        """The first line of each member's docstring, without its period, by the member's name."""
        return {name: (member.__doc__ or name).splitlines()[0].rstrip(".") for name, member in self.all().items()}

    def add(self, thing: object, where: str = "register") -> str:
        """Add a member and return its name; a member with a method `check_formulas` is checked by that method.

        where  the location that errors name
        Raises InputError if it is not a member of this family, fails the check, or has the name of another member.
        """
        named = self._member(thing)
        if named is None:
            title = getattr(thing, "__qualname__", "") or shown(thing)
            what = f"{title} is not a {self.kind} with a name"
            raise InputError(what, where, "derive it from the family's base class")
        name, member = named
        standing = self.all().get(name)
        if standing is not None and _same(standing, member):
            return name
        check = getattr(member, "check_formulas", None)
        if callable(check) and not isinstance(member, type):
            check()
        overridable = getattr(standing, "overridable", False)
        if standing is not None and standing is not member and not overridable and _source(standing) != _source(member):
            what = f"the {self.kind} '{name}' already exists, in {_source(standing)[0]}"
            raise InputError(what, where, "give yours another name")
        self._added[name] = member
        for watcher in self._watchers:
            watcher(name, member)
        return name

    def portable(self, name: str) -> Member | type | str:
        """An object from which another process obtains the same member.

        This is the class or instance itself if this program added it, otherwise the name.
        """
        if name in self._announced_names or name not in self._added:
            return name
        member = self._added[name]
        return type(member) if not isinstance(member, type) and getattr(type(member), "name", "") == name else member

    def spelled(self, name: str) -> str:
        """The string that identifies a member to another process: FILE.py:NAME if this program added it, else its name.

        NAME is the name of the class, or of the module-level variable that holds the instance.
        """
        if self.portable(name) == name:
            return name
        member = self._added[name]
        file, title = _source(member)
        held = vars(sys.modules.get(_class_of(member).__module__, sys))
        title = next((one for one, value in held.items() if value is member), title)
        return f"{file}:{title}" if file.endswith(".py") and title.isidentifier() else name

    def watch(self, watcher: Callable[[str, Member], None]) -> None:
        """Call `watcher(name, member)` for every member added later; each watcher is registered once."""
        self._watchers[watcher] = None

    def remove(self, name: str) -> None:
        """Remove a member that `add` added."""
        self._added.pop(name, None)

    def _announced(self, point: EntryPoint) -> None:
        """Load the members of an installed package; an error in the package causes only a warning."""
        where = f"entry point {self.group}: {point.name} = {point.value}"
        try:
            self._announced_names.add(self.add(point.load(), where))
        except Exception as error:  # third-party code
            warnings.warn(f"{where} is ignored: {type(error).__name__}: {error}", GonioWarning, stacklevel=4)

    def _in_package(self, package: str) -> Iterable[tuple[str, Member]]:
        for module in _modules(package):
            name = module.__name__
            for thing in list(vars(module).values()):
                # objects that a module imports belong to the module that defines them
                if getattr(thing, "__module__", name) == name and (pair := self._member(thing)) is not None:
                    yield pair


def _modules(package: str) -> list[ModuleType]:
    """The modules of a package, imported."""
    with garbage.paused():  # imports create no garbage; collection would take 7 % of a command's start-up time
        entries = pkgutil.iter_modules(importlib.import_module(package).__path__)
        return [importlib.import_module(f"{package}.{entry.name}") for entry in entries]


def _entry_points(group: str) -> Iterable[EntryPoint]:
    """The entry points of a group.

    Metadata files are first searched for the group's name, because loading importlib.metadata takes longer than the
    rest of `gonio --help`.
    """
    # importlib.metadata can read inside a zip
    if any(Path(place).is_file() or _declares(place, group.encode()) for place in sys.path):
        from importlib.metadata import entry_points

        return entry_points(group=group)
    return ()


def _declares(folder: str, group: bytes) -> bool:
    """Whether a package installed in a folder may declare entry points of a group."""
    with contextlib.suppress(OSError):
        for name in os.listdir(folder or "."):
            if name.endswith("-info"):
                with contextlib.suppress(OSError):
                    if group in Path(folder, name, "entry_points.txt").read_bytes():
                        return True
    return False


Thing = TypeVar("Thing")
registered: list[str] = []  # names that this program added, which do not exist in other processes


def register(thing: Thing) -> Thing:
    """Add a member to its family: a material, a distribution, a masking term, an integrator, a law, ...

        @go.register
        class Ward(go.BSDF): ...

    The member is then available by name, as Gonio's own members are. Returns the object unchanged. Raises InputError if
    the object belongs to no family, or if another member already has its name.
    """
    registered.append(family_of(thing).add(thing))
    return thing


def family_of(thing: object) -> Family[object]:
    """The family of a class or instance: the `family` of its base class."""
    family = getattr(thing, "family", None)
    if not isinstance(family, Family):
        what = f"{getattr(thing, '__qualname__', repr(thing))} is not a member of a family"
        raise InputError(what, "register", "derive it from a base class such as gonio.BSDF, gonio.NDF or gonio.Masking")
    return family


def _class_of(member: object) -> type:
    return member if isinstance(member, type) else type(member)


def _same(standing: object, member: object) -> bool:
    """Whether two members are interchangeable: identical, or instances of the same class with the same values."""
    if standing is member:
        return True
    if isinstance(standing, type) or isinstance(member, type) or type(standing) is not type(member):
        return False
    return _settings(standing) == _settings(member)


def _settings(member: object) -> dict[str, str]:
    return {name: repr(value) for name, value in getattr(member, "__dict__", {}).items() if not name.startswith("_")}


def _source(member: object) -> tuple[str, str]:
    """File (or module) and name of a member; they do not change if its class is loaded again."""
    thing = member if isinstance(member, type) or callable(member) else type(member)
    module = sys.modules.get(thing.__module__)
    file = str(getattr(module, "__file__", None) or thing.__module__)
    return str(Path(file).resolve()) if file.endswith(".py") else file, str(getattr(thing, "__qualname__", thing))


def subclasses_of(base: type[Member]) -> Callable[[object], tuple[str, type[Member]] | None]:
    """A `member` function for families of classes: accepts named classes that derive from `base`."""

    def member(thing: object) -> tuple[str, type[Member]] | None:
        if not isinstance(thing, type) or not issubclass(thing, base):
            return None
        name = str(getattr(thing, "name", ""))  # shared base classes have none
        return (name, thing) if name else None

    return member


def instances_of(base: type[Member]) -> Callable[[object], tuple[str, Member] | None]:
    """A `member` function for families of instances: accepts instances, and classes, which it instantiates.

    The constructor is called without arguments. The values of a given instance become part of the name, as in
    "gtr-gamma-1.5".
    """

    def member(thing: object) -> tuple[str, Member] | None:
        if isinstance(thing, base):
            name = str(getattr(thing, "name", ""))
            given = "name" in getattr(thing, "__dict__", {})
            values = [] if given else [f"-{key}-{value}" for key, value in sorted(_settings(thing).items())]
            return (name + "".join(values).replace(" ", ""), thing) if name else None
        named = of_class(thing)
        if named is None:
            return None
        try:
            return named[0], named[1]()
        except TypeError as error:
            what = f"{getattr(thing, '__name__', thing)}() fails: {error}"
            raise InputError(what, _source(thing)[0], "give its arguments defaults, or name an instance") from None

    of_class = subclasses_of(base)
    return member
