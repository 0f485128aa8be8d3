"""Write docs/models/NAME.md for every model from its docstring and its declared parameters.

python docs/make_pages.py [--check]      --check writes nothing and fails where a page is out of date
"""

from __future__ import annotations

import inspect
import sys
from pathlib import Path

import gonio as go

FOLDER = Path(__file__).parent / "models"


def page(name: str, model: type) -> str:
    """The manual page of one model, in Markdown."""
    lines = [f"# {model.__name__}", "", "```text", inspect.getdoc(model) or "", "```", ""]
    lines += ["| parameter | kind | range | unit | default | meaning |", "|---|---|---|---|---|---|"]
    for p in model.parameters().values():
        default = "required" if p.required else f"`{p.default}`"
        allowed = "<br>".join(f"`{key}`: {text}" for key, text in p.choices.items()) or p.range
        lines.append(f"| `{p.name}` | {p.kind} | {allowed} | {p.unit or '-'} | {default} | {p.doc} |")
    for law, breach in model.breaks.items():
        lines += ["", f"Breaks **{law}** by nature: {breach.reason}."]
    source = "src/" + model.__module__.replace(".", "/") + ".py"
    plugin = "gonio_" + name.replace("-", "_")
    lines += ["", f"Mitsuba plugin `{plugin}`. Source: `{source}`.", ""]
    return "\n".join(lines)


def main() -> int:
    """Write or check the pages; returns the exit code."""
    check = "--check" in sys.argv[1:]
    pages = {FOLDER / f"{name}.md": page(name, model) for name, model in go.models().items()}
    stale = [path for path, text in pages.items() if not path.exists() or path.read_text() != text]
    stale += [path for path in FOLDER.glob("*.md") if path not in pages]
    if check:
        for path in stale:
            print(f"out of date: {path}; run `make docs`")
        return 1 if stale else 0
    FOLDER.mkdir(exist_ok=True)
    for path in stale:
        if path in pages:
            path.write_text(pages[path])
        else:
            path.unlink()
    print(f"{len(pages)} pages, {len(stale)} written")
    return 0


if __name__ == "__main__":
    sys.exit(main())
