"""A page for each family of parts (distributions, masking terms, Fresnel kinds, integrators, laws, ...)."""

from __future__ import annotations

from gonio.viewer import families

from .text import escaped, markdown, table

INTRODUCTION = """# Parts

Every family of parts has a page here; each member has its description, its own functions and the way it is used.
`gonio explain NAME` prints the same text, and your own files may add members
([CONTRIBUTING](../../project/contributing.md)).
"""

# below the introduction of a family
PICTURES = {
    "law": """![Pairs of balls, sound and with one mistake that a law finds](../../../examples/broken-laws/laws.jpg)

What a violation looks like: [a ball for each broken law](../../gallery/broken-laws.md).
"""
}


def pages() -> dict[str, str | bytes]:
    """A page for each family, without the materials, and their index."""
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
                    parts.append(table(("function", ""), rows))
                parts.append(f"Use: `{page.use}`. Source: `{page.source}`.")
    return "\n\n".join(parts) + "\n"
