"""A page for each family of components (distributions, masking terms, Fresnel models, integrators, laws, ...)."""

from __future__ import annotations

from gonio.viewer import families

from .text import escaped, markdown, table

INTRODUCTION = """# Components

There is a page for each family of components, such as masking terms or integrators. It describes each member of the
family, its functions and its use. `gonio explain NAME` prints the same text. Your own files can add members
([CONTRIBUTING](../../project/contributing.md)).
"""

# shown below the introduction of a family
PICTURES = {
    "law": """![Pairs of balls: a correct material, and one with a mistake](../../../examples/broken-laws/laws.jpg)

For the effect of each violation on a picture, see [a ball for each broken law](../../gallery/broken-laws.md).
"""
}


def pages() -> dict[str, str | bytes]:
    """A page for each family except the materials, and an index of these pages."""
    made: dict[str, str | bytes] = {}
    rows = []
    for kind, (family, _) in families.families().items():
        if kind == "material":
            continue
        key = kind.replace(" ", "-")
        made[f"reference/families/{key}.md"] = _page(kind, sorted(family.all()))
        rows.append((f"[{kind}]({key}.md)", ", ".join(f"`{name}`" for name in family.all())))
    listed = "\n".join(path.rpartition("/")[2].removesuffix(".md") for path in made)
    toctree = f":::{{toctree}}\n:hidden:\n\n{listed}\n:::"
    made["reference/families/index.md"] = "\n".join([INTRODUCTION, table(("family", "members"), rows), "", toctree, ""])
    return made


def _page(kind: str, names: list[str]) -> str:
    title = families.pages(kind)[0]
    assert isinstance(title, families.FamilyPage)
    parts = [f"# {families._plural(kind).capitalize()}", markdown(title.doc), PICTURES.get(kind, "")]
    for name in names:
        for page in families.pages(name):
            if isinstance(page, families.MemberPage) and page.kind == kind:
                parts += [f"## {name}", markdown(page.doc)]
                if page.formulas:
                    rows = [(f"`{one}`", escaped(text)) for one, text in page.formulas.items()]
                    parts.append(table(("function", "description"), rows))
                parts.append(f"Use: `{page.use}`. Source: `{page.source}`.")
    return "\n\n".join(parts) + "\n"
