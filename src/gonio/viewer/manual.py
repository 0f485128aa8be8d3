"""The manual page of a material, from its docstring and declared properties, for `gonio explain` and docs/models."""

from __future__ import annotations

import inspect
import textwrap
from dataclasses import asdict, dataclass

from ..material import BSDF

_WIDTH = 100


@dataclass(frozen=True)
class Row:
    """The declaration of a parameter; `default` is "required" if there is no default."""

    name: str
    doc: str
    kind: str
    range: str
    unit: str
    default: str
    choices: dict[str, str]


@dataclass(frozen=True)
class Page:
    """The manual page of a material. `breaks` maps the names of violated laws to reasons; `presets` maps names to
    titles."""

    name: str
    title: str
    doc: str
    parameters: tuple[Row, ...]
    breaks: dict[str, str]
    presets: dict[str, str]
    plugin: str
    source: str

    def as_dict(self) -> dict[str, object]:
        return asdict(self)

    def markdown(self) -> str:
        lines = [f"# {self.title}", "", "```text", self.doc, "```", ""]
        lines += ["| parameter | kind | range | unit | default | meaning |", "|---|---|---|---|---|---|"]
        for row in self.parameters:
            default = row.default if row.default == "required" else f"`{row.default}`"
            allowed = (
                "<br>".join(f"`{key}`: {text[:1].upper()}{text[1:]}" for key, text in row.choices.items()) or row.range
            )
            lines.append(f"| `{row.name}` | {row.kind} | {allowed} | {row.unit or '-'} | {default} | {row.doc} |")
        for law, reason in self.breaks.items():
            lines += ["", f"By design, this model violates the **{law}** law: {reason}."]
        if self.presets:
            named = ", ".join(f"`{name}`{_also(name, title)}" for name, title in self.presets.items())
            lines += ["", f"Presets: {named}."]
        return "\n".join([*lines, "", f"Mitsuba plugin: `{self.plugin}`. Source: `{self.source}`.", ""])

    def text(self, width: int = _WIDTH) -> str:
        """The page for a terminal with `width` columns."""
        indent = max((len(row.name) for row in self.parameters), default=0) + 4

        def filled(text: str, at: int, first: str = "") -> str:
            return textwrap.fill(text, min(width, _WIDTH), initial_indent=f"{first:<{at}}", subsequent_indent=" " * at)

        lines = [self.name, "=" * len(self.name), self.doc, ""]
        for row in self.parameters:
            facts = [
                row.kind,
                *([row.range] * (not row.choices and row.range != row.kind)),
                *([row.unit] * bool(row.unit)),
            ]
            facts.append(row.default if row.default == "required" else f"default {row.default}")
            lines += [filled(row.doc, indent, f"  {row.name}"), " " * indent + ", ".join(facts)]
            lines += [filled(f"{choice}: {meaning}", indent + 2) for choice, meaning in row.choices.items()]
        lines += [""] * bool(self.parameters)
        if self.presets:
            named = ", ".join(f"{name}{_also(name, title)}" for name, title in self.presets.items())
            lines += [filled(named, 11, "  presets"), ""]
        lines += [
            filled(f"By design, this model violates the {law} law: {reason}.", 0) for law, reason in self.breaks.items()
        ]
        return "\n".join([*lines, f"Mitsuba plugin: {self.plugin}", f"Source: {self.source}"])


def _also(name: str, title: str) -> str:
    return f" ({title})" if title and title != name else ""


def page(model: type[BSDF]) -> Page:
    """The manual page of a material class."""
    rows = tuple(
        Row(
            parameter.name,
            parameter.doc,
            parameter.kind,
            parameter.range,
            parameter.unit,
            "required" if parameter.required else str(parameter.default),
            dict(parameter.choices),
        )
        for parameter in model.parameters().values()
    )
    own = model.__module__.startswith("gonio.") and not model.spelling
    return Page(
        name=model.name,
        title=model.__name__,
        doc=inspect.getdoc(model) or "",
        parameters=rows,
        presets={name: preset.title for name, preset in model.presets().items()},
        breaks={law: breach.reason for law, breach in model.known_violations.items()},
        plugin="gonio_" + model.name.replace("-", "_"),
        source="src/" + model.__module__.replace(".", "/") + ".py" if own else model.spelling or inspect.getfile(model),
    )
