"""A family of members that anyone may add to: materials, distributions, laws, verbs, ...

A member is found in one of three places, and nowhere has it to be listed:

    one file in the family's folder                     whatever stands in `src/gonio`
    an entry point of an installed package              [project.entry-points."gonio.models"]  ward = "mypackage:Ward"
    `go.register(Ward)`, in a program or as decorator

Names are unique in a family: a member that takes the name of another is an error, unless that one says that it gives
way (`overridable`: Gonio's historic models, whose names are what people write first), or it is the same class again,
from a file that was loaded anew.
"""

from __future__ import annotations

import importlib
import pkgutil
import sys
import warnings
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Generic, TypeVar

from .arguments import shown
from .errors import GonioWarning, InputError, did_you_mean

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

Member = TypeVar("Member")


class Family(Generic[Member]):
    """The members of one kind, by name.

    kind     what a member is called in errors, "material"
    group    the entry points' group, "gonio.models"
    folders  packages whose modules hold members, looked through when the first is asked for
    member   what of a module or an entry point is a member, as (name, member); None where it is none
    where    what an error about an unknown name points at
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
        self._found: dict[str, Member] | None = None
        self._added: dict[str, Member] = {}
        self._announced_names: set[str] = set()  # of those that installed packages bring
        self._watchers: dict[Callable[[str, Member], None], None] = {}

    def all(self) -> dict[str, Member]:
        """Every member by name, in alphabetical order."""
        if self._found is None:
            folders = self._folders() if callable(self._folders) else self._folders
            self._found = dict(pair for folder in folders for pair in self._in_package(folder))
            for point in _entry_points(self.group):
                self._announced(point)
        return dict(sorted({**self._found, **self._added}.items()))

    def get(self, name: str, where: str = "") -> Member:
        """The member of that name. InputError with the nearest known spelling where there is none."""
        if self._found is None:
            self.all()
        if not isinstance(name, str):
            raise InputError(f"{shown(name)} is no name", where or self.where, "give the name of a " + self.kind)
        for known in (self._added, self._found or {}):  # asked at every call of a formula: nothing is sorted here
            if name in known:
                return known[name]
        raise InputError(f"unknown {self.kind} '{name}'", where or self.where, did_you_mean(name, list(self.all())))

    def titles(self) -> dict[str, str]:
        """Name -> first line of the member's docstring, without its full stop: what help and the manual print."""
        return {name: (member.__doc__ or name).splitlines()[0].rstrip(".") for name, member in self.all().items()}

    def add(self, thing: object, where: str = "register") -> str:
        """Add a member; its name. InputError where it is none, cannot serve as one, or takes the name of another.

        One that has `check_formulas` is asked whether it can serve.
        """
        found = self._member(thing)
        if found is None:
            title = getattr(thing, "__qualname__", "") or shown(thing)
            raise InputError(f"{title} is no {self.kind} with a name", where, "derive it from the family's base class")
        name, member = found
        standing = self.all().get(name)
        if standing is not None and _same(standing, member):
            return name
        check = getattr(member, "check_formulas", None)
        if callable(check) and not isinstance(member, type):
            check()
        overridable = getattr(standing, "overridable", False)
        if standing is not None and standing is not member and not overridable and _source(standing) != _source(member):
            what = f"the {self.kind} '{name}' is there already, in {_source(standing)[0]}"
            raise InputError(what, where, "give yours another name")
        self._added[name] = member
        for watcher in self._watchers:
            watcher(name, member)
        return name

    def portable(self, name: str) -> Member | type | str:
        """What stands for a member in another process: its class, or the instance that was given, where this program
        added it; else its name."""
        if name in self._announced_names or name not in self._added:
            return name
        member = self._added[name]
        return type(member) if not isinstance(member, type) and getattr(type(member), "name", "") == name else member

    def spelled(self, name: str) -> str:
        """How a text names a member in another process: FILE.py:NAME of one that this program added, else its name.

        NAME is that of its class; of an instance that a module holds, the name that it has there.
        """
        if self.portable(name) == name:
            return name
        member = self._added[name]
        file, title = _source(member)
        held = vars(sys.modules.get(_class_of(member).__module__, sys))
        title = next((one for one, value in held.items() if value is member), title)
        return f"{file}:{title}" if file.endswith(".py") and title.isidentifier() else name

    def watch(self, watcher: Callable[[str, Member], None]) -> None:
        """Call `watcher(name, member)` for every member that is added from now on; the same one only once."""
        self._watchers[watcher] = None

    def remove(self, name: str) -> None:
        """Take back what `add` added."""
        self._added.pop(name, None)

    def _announced(self, point: EntryPoint) -> None:
        """What an installed package brings; a broken one costs a warning and nothing else."""
        where = f"entry point {self.group}: {point.name} = {point.value}"
        try:
            self._announced_names.add(self.add(point.load(), where))
        except Exception as error:  # a package of somebody else's
            warnings.warn(f"{where} is left out: {type(error).__name__}: {error}", GonioWarning, stacklevel=4)

    def _in_package(self, package: str) -> Iterable[tuple[str, Member]]:
        module = importlib.import_module(package)
        for entry in pkgutil.iter_modules(module.__path__):
            name = f"{package}.{entry.name}"
            for thing in vars(importlib.import_module(name)).values():
                # what a module imports from another is that other's
                if getattr(thing, "__module__", name) == name and (found := self._member(thing)) is not None:
                    yield found


def _entry_points(group: str) -> Iterable[EntryPoint]:
    """The entry points of a group. Where no installed package names the group, which a look into their files tells,
    importlib.metadata is not even loaded: that takes longer than the rest of `gonio --help`."""
    for place in map(Path, sys.path):
        files = place.glob("*-info/entry_points.txt")
        # a zip is left to importlib.metadata, which can look inside
        if place.is_file() or any(group.encode() in file.read_bytes() for file in files):
            from importlib.metadata import entry_points

            return entry_points(group=group)
    return ()


Thing = TypeVar("Thing")
registered: list[str] = []  # by this program: what another process does not know of


def register(thing: Thing) -> Thing:
    """Add a member to its family: a material, a distribution, a masking term, an integrator, a law, ...

        @go.register
        class Ward(go.BSDF): ...

    It is then known by its name wherever Gonio's own are. Returns the thing itself. InputError where it belongs to no
    family, or takes the name of a member that is another.
    """
    registered.append(family_of(thing).add(thing))
    return thing


def family_of(thing: object) -> Family[object]:
    """The family that a class, or an instance of one, belongs to: what its base class names as `family`."""
    family = getattr(thing, "family", None)
    if not isinstance(family, Family):
        what = f"{getattr(thing, '__qualname__', repr(thing))} is no member of a family"
        raise InputError(what, "register", "derive it from gonio.BSDF, gonio.NDF, gonio.Masking or their like")
    return family


def _class_of(member: object) -> type:
    return member if isinstance(member, type) else type(member)


def _same(standing: object, member: object) -> bool:
    """Whether one member can stand for another: the same, or instances of one class with the same values."""
    if standing is member:
        return True
    if isinstance(standing, type) or isinstance(member, type) or type(standing) is not type(member):
        return False
    return _settings(standing) == _settings(member)


def _settings(member: object) -> dict[str, str]:
    return {name: repr(value) for name, value in getattr(member, "__dict__", {}).items() if not name.startswith("_")}


def _source(member: object) -> tuple[str, str]:
    """File (or module) and name of a member: the same for a class that was loaded anew."""
    thing = member if isinstance(member, type) or callable(member) else type(member)
    module = sys.modules.get(thing.__module__)
    file = str(getattr(module, "__file__", None) or thing.__module__)
    return str(Path(file).resolve()) if file.endswith(".py") else file, str(getattr(thing, "__qualname__", thing))


def subclasses_of(base: type[Member]) -> Callable[[object], tuple[str, type[Member]] | None]:
    """What takes classes that derive from `base` and have a name, as members."""

    def member(thing: object) -> tuple[str, type[Member]] | None:
        if not isinstance(thing, type) or not issubclass(thing, base):
            return None
        name = str(getattr(thing, "name", ""))  # a base that members share has none
        return (name, thing) if name else None

    return member


def instances_of(base: type[Member]) -> Callable[[object], tuple[str, Member] | None]:
    """As `subclasses_of`, for families whose members are instances: the one that a class makes without arguments, or
    one that is given, whose values are then part of its name: "gtr-gamma-1.5"."""

    def member(thing: object) -> tuple[str, Member] | None:
        if isinstance(thing, base):
            name = str(getattr(thing, "name", ""))
            given = "name" in getattr(thing, "__dict__", {})
            values = [] if given else [f"-{key}-{value}" for key, value in sorted(_settings(thing).items())]
            return (name + "".join(values).replace(" ", ""), thing) if name else None
        found = of_class(thing)
        if found is None:
            return None
        try:
            return found[0], found[1]()
        except TypeError as error:
            what = f"{getattr(thing, '__name__', thing)}() fails: {error}"
            raise InputError(what, _source(thing)[0], "give its arguments defaults, or name an instance") from None

    of_class = subclasses_of(base)
    return member
