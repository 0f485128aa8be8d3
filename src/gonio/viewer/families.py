"""The output of `gonio explain` for members of families other than materials, and for the families themselves.

Verbs are not included: `gonio VERB --help` describes them.
"""

from __future__ import annotations

import inspect
import textwrap
from dataclasses import asdict, dataclass
from importlib import import_module
from typing import Any, NamedTuple

from ..catalog import outside
from ..errors import InputError, did_you_mean
from ..members import Family

WIDTH = 100


class Home(NamedTuple):
    """The module that defines a family's base class, and the use of a member."""

    module: str
    base: str
    use: str


HOMES = (
    Home("gonio.material", "BSDF", "gonio plot {name}"),
    Home("gonio.optics.ndf", "NDF", "--param ndf={name}, gonio bake {name}"),
    Home("gonio.optics.masking", "Masking", "--param masking={name}"),
    Home("gonio.optics.fresnel", "Fresnel", "--param fresnel={name}"),
    Home("gonio.transport.integrators", "Integrator", "gonio render SCENE --integrator {name}"),
    Home("gonio.verify.laws", "Law", "gonio verify TARGET --law {name}"),
    Home("gonio.shaders.languages", "Language", "gonio emit MODEL --lang {name}"),
    Home("gonio.instruments.surfaces.base", "Surface", "gonio measure --surface {name} -o FILE"),
    Home("gonio.measure.tables.base", "Measurement", "gonio measure MODEL --table {name} -o FILE.gonio"),
    Home("gonio.measure.formats.base", "Format", "a file with its suffix, wherever measured values are accepted"),
    Home("gonio.measure.compression.base", "Method", "gonio compress FILE --codec {name} -o OUT.gonio"),
    Home("gonio.catalog.documents", "Document", 'in a scene {{"type": "{name}", "file": ...}}'),
    Home("gonio.viewer.panels.base", "Panel", "a panel of gonio view"),
)


@dataclass(frozen=True)
class MemberPage:
    """The description of a member.

    kind      kind of the family's members, such as "masking term"
    doc       docstring of the member
    formulas  methods of the member: name -> first line of the docstring
    use       example of its use
    source    file that defines the member
    """

    name: str
    kind: str
    doc: str
    formulas: dict[str, str]
    use: str
    source: str

    def as_dict(self) -> dict[str, object]:
        return asdict(self)

    def text(self, width: int = WIDTH) -> str:
        """The page for a terminal with `width` columns."""
        heading = f"{self.name} ({self.kind})"
        lines = [heading, "=" * len(heading), self.doc, ""]
        lines += _listed(self.formulas, width)
        return "\n".join([*lines, *[""] * bool(self.formulas), f"Use: {self.use}", f"Source: {self.source}"])


@dataclass(frozen=True)
class FamilyPage:
    """The description of a family: its members by name, with one line per member."""

    name: str
    doc: str
    members: dict[str, str]
    use: str

    def as_dict(self) -> dict[str, object]:
        return asdict(self)

    def text(self, width: int = WIDTH) -> str:
        """The page for a terminal with `width` columns."""
        heading = _plural(self.name)
        lines = [heading, "=" * len(heading), self.doc, "", *_listed(self.members, width), ""]
        return "\n".join([*lines, f"Use: {self.use}"])


def families() -> dict[str, tuple[Family[Any], Home]]:
    """Every family by the kind of its members, such as "masking term"."""
    pairs = ((getattr(import_module(home.module), home.base).family, home) for home in HOMES)
    return {family.kind: (family, home) for family, home in pairs}


def index() -> FamilyPage:
    """The list of all families, for a call without a name."""
    names = {_plural(kind): ", ".join(family.all()) for kind, (family, _) in families().items()}
    lines = {kind: text for kind, text in names.items() if text}
    doc = "The kinds of components that Gonio provides and that you can extend with your own files."
    return FamilyPage("family", doc, lines, "gonio explain NAME")


def pages(name: str) -> list[MemberPage | FamilyPage]:
    """The pages for a name: one per member with this name, or the page of a family. Raises InputError for an unknown
    name."""
    if outside.names_code(name):
        return [_of_code(name)]
    known = families()
    members = [_page(family.all()[name], home) for family, home in known.values() if name in family.all()]
    if members:
        return [*members]
    for kind, (family, home) in known.items():
        if _key(name) in _aliases(kind, family):
            return [FamilyPage(kind, _doc(_base(home)), family.titles(), home.use.format(name="NAME"))]
    names = [*(one for family, _ in known.values() for one in family.all()), *map(_plural, known)]
    raise InputError(f"no member or family has the name '{name}'", "MODEL", _hint(name, names))


def _hint(name: str, names: list[str]) -> str:
    near = did_you_mean(name, names)
    return near if near.startswith("did") else "gonio explain without a name lists the families"


def _of_code(name: str) -> MemberPage:
    """The page of a class in a file that is, or could be, a member of a family."""
    cls = outside.thing(name, where="MODEL")
    home = next((home for home in HOMES[1:] if isinstance(cls, type) and issubclass(cls, _base(home))), None)
    if home is None:
        hint = "gonio explain without a name lists the families"
        raise InputError(f"{name} is not a member of a family", "MODEL", hint)
    return _page(cls, home, name)


def _base(home: Home) -> type:
    base: type = getattr(import_module(home.module), home.base)
    return base


def _page(member: Any, home: Home, called: str = "") -> MemberPage:
    """The page of a member. `called` is its name in commands, by default the member's own name."""
    cls = member if isinstance(member, type) else type(member)
    formulas = {
        name: (inspect.getdoc(thing) or "").partition("\n")[0]
        for name, thing in vars(cls).items()
        if not name.startswith("_") and callable(thing) and inspect.getdoc(thing)
    }
    name = str(getattr(member, "name", "") or cls.__name__)
    source = f"src/{cls.__module__.replace('.', '/')}.py"
    if not cls.__module__.startswith("gonio."):
        source = str(inspect.getsourcefile(cls))
    kind = _base(home).family.kind  # type: ignore[attr-defined]  # the base class has a family
    return MemberPage(
        name,
        kind,
        inspect.cleandoc(cls.__doc__ or ""),
        formulas,
        home.use.format(name=called or name),
        source,
    )


def _aliases(kind: str, family: Family[Any]) -> set[str]:
    """The accepted names of a family: "masking terms", "masking", "maskings"."""
    return {_key(word) for word in (kind, kind.split()[-1], family.group.partition(".")[2], family.where)}


def _key(name: str) -> str:
    """A name in the singular, without separators between its words."""
    return "".join(letter for letter in name.lower() if letter.isalnum()).removesuffix("s")


def _plural(kind: str) -> str:
    first, _, rest = kind.partition(" of ")
    many = first.removesuffix("y") + "ies" if first.endswith("y") else first + "s"
    return f"{many} of {rest}s" if rest else many


def _doc(cls: type) -> str:
    return (inspect.getdoc(cls) or "").split("\n\n")[0]


def _listed(rows: dict[str, str], width: int) -> list[str]:
    indent = min(max((len(name) for name in rows), default=0) + 4, 32)
    return [
        textwrap.fill(
            text, min(width, WIDTH), initial_indent=f"{'  ' + name:<{indent}}", subsequent_indent=" " * indent
        )
        for name, text in rows.items()
    ]


__all__ = ["FamilyPage", "MemberPage", "families", "index", "pages"]
