"""Write docs/models/NAME.md for every model, which `gonio explain` prints, and the tables in the README files.

python docs/make_pages.py [--check] [--tables]   --check writes nothing and fails if a page is out of date
                                                 --tables omits docs/models, which takes a minute
"""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Iterator
from pathlib import Path

import gonio as go
from gonio.verify import quality
from gonio.viewer import manual

FOLDER = Path(__file__).parent / "models"
ROOT = Path(__file__).parents[1]
NUMBER = re.compile(r"\d*\.?\d+")
PICTURE = re.compile(r"!\[([^\]]*)\]\(([^)]+)\)")
GROUPS = {  # folder of gonio.materials -> title, in English and Chinese
    "diffuse": ("diffuse", "漫反射"),
    "empirical": ("empirical", "经验模型"),
    "microfacet": ("microfacet: metals, glass, thin films", "微表面:金属、玻璃、薄膜"),
    "compensated": ("with multiple scattering", "多次散射补偿"),
    "layered": ("layered", "多层材质"),
    "sheen": ("cloth", "织物"),
    "historic": ("models of published fits", "文献拟合所用模型"),
    "combined": ("composed of other materials", "由材质组合的材质"),
    "measured": ("measured", "测量 BRDF"),
}


def main() -> int:
    """Write or check the pages; returns the exit code."""
    check = "--check" in sys.argv[1:]
    stale = _tables(check)
    if "--tables" in sys.argv[1:]:
        return _told(stale) if check else 0
    same = _alike if check else str.__eq__
    sampling = quality.of_models()
    pages = {
        FOLDER / f"{name}.md": manual.page(model).markdown() + _sampling(*sampling[name])
        for name, model in go.models().items()
    }
    stale += [path for path, text in pages.items() if not (path.exists() and same(path.read_text(), text))]
    stale += [path for path in FOLDER.glob("*.md") if path not in pages]
    if check:
        return _told(stale)
    FOLDER.mkdir(exist_ok=True)
    for path in stale:
        if path in pages:
            path.write_text(pages[path])
        elif path.parent == FOLDER:
            path.unlink()
    print(f"{len(pages)} pages, {len(stale)} written")
    return 0


def _told(stale: list[Path]) -> int:
    for path in stale:
        print(f"out of date: {path}; run `make docs`")
    return 1 if stale else 0


def _tables(check: bool) -> list[Path]:
    """Write the tables between the marks of the pages that have them; returns the files that were out of date."""
    tables = {
        "README.md": {"models": _models(0), "gallery": _gallery()},
        "README.zh.md": {"models": _models(1), "gallery": _gallery()},
        "examples/README.md": {"gallery": _index()},
    }
    stale = []
    for name, marks in tables.items():
        path = ROOT / name
        text = new = path.read_text(encoding="utf-8")
        for mark, table in marks.items():
            start, end = f"<!-- {mark} -->\n", f"<!-- /{mark} -->"
            before, _, rest = new.partition(start)
            new = before + start + table + end + rest.partition(end)[2]
        if new != text:
            stale.append(path)
            if not check:
                path.write_text(new, encoding="utf-8")
    return stale


def _models(language: int) -> str:
    """All models by group, each with a link to its page."""
    lines = [(f"| {len(go.models())} models | |", f"| {len(go.models())} 个模型 | |")[language], "|---|---|"]
    for folder, titles in GROUPS.items():
        members = [name for name, model in go.models().items() if model.__module__.split(".")[2] == folder]
        links = ", ".join(f"[{name}](docs/models/{name}.md)" for name in members)
        lines.append(f"| {titles[language]} | {links} |")
    return "\n".join(lines) + "\n"


def _examples() -> Iterator[tuple[str, str, str, str]]:
    """Folder, title, picture file and caption of every example that shows a picture."""
    for page in sorted((ROOT / "examples").glob("*/README.md")):
        text = page.read_text(encoding="utf-8")
        if picture := PICTURE.search(text):
            yield page.parent.name, text.partition("\n")[0].removeprefix("# "), picture[2], picture[1]


def _gallery() -> str:
    """A thumbnail of every example, with a link to its page."""
    lines = [
        f'<a href="examples/{folder}"><img src="examples/{folder}/{file}" height="90" alt="{title}"></a>'
        for folder, title, file, _ in _examples()
    ]
    return "\n".join(lines) + "\n"


def _index() -> str:
    """One row per example: thumbnail, title with a link, and caption."""
    lines = ["| picture | example | what it shows |", "|---|---|---|"]
    for folder, title, file, caption in _examples():
        thumbnail = f'<a href="{folder}"><img src="{folder}/{file}" width="240" alt="{title}"></a>'
        lines.append(f"| {thumbnail} | [{title}]({folder}/README.md) | {caption} |")
    return "\n".join(lines) + "\n"


def _alike(old: str, new: str) -> bool:
    """Whether two pages are equal; the values of sampling quality may differ by 10 %, because they vary with the
    processor."""
    *lines, last = old.splitlines()
    *new_lines, new_last = new.splitlines()
    figures = [float(number) for number in NUMBER.findall(last)]
    new_figures = [float(number) for number in NUMBER.findall(new_last)]
    return (
        lines == new_lines
        and NUMBER.sub("", last) == NUMBER.sub("", new_last)
        and all(math.isclose(a, b, rel_tol=0.1) for a, b in zip(figures, new_figures, strict=True))
    )


def _sampling(title: str, found: quality.Quality | None) -> str:
    """A paragraph on how well a material samples itself."""
    if found is None:
        return ""
    failed, variance, cosine, ideal = found.numbers
    compared = f"{cosine} times that of cosine sampling and " if cosine else ""
    return (
        f"\nSampling of `{title}`: {failed} of the samples fail, the relative variance of the weights is {variance}, "
        f"and the efficiency is {compared}{ideal} of the ideal "
        "([how these values are measured](../verify.md#sampling-quality)).\n"
    )


if __name__ == "__main__":
    sys.exit(main())
