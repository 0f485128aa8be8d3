"""Check the words of the project: names in code, and prose in documents, docstrings and comments. `make lint` runs it.

    python tools/words.py            # prints every finding with file and line; exit code 1 if there is any

Names should be the field's own terms, and prose should be American English that states its subject first. The lists
below hold words that have been replaced, so that they do not come back.
"""

from __future__ import annotations

import ast
import io
import re
import sys
import tokenize
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]

# names of functions, classes, arguments and variables, and their replacements
NAMES = {
    "account": "LayerTables",
    "again": "u_remapped, or what it is",
    "alone": "hero_only, or what it is",
    "around": "to_frame",
    "beside": "what it is",
    "beside_lobes": "mis_compensation",
    "black_fails": "zero_weight_is_failure",
    "brought": "gather_photons",
    "crew": "executor",
    "followed": "after_bounce",
    "found": "metadata, value, hits, result: what it is",
    "gathers": "merge_materials",
    "gives_way": "overridable",
    "kept": "what it is",
    "leans": "perturbs_normal",
    "met": "on_hit",
    "renewed": "regenerate",
    "seen": "direct_weight, visited, or what it is",
    "settled": "evaluate_derived",
    "taken": "coerce",
    "turned": "wo_local",
    "two_widths": "anisotropic",
    "upright": "normal_like",
    "whole": "with_valid_bbox, total, or what it is",
}

BRITISH = (
    "behaviour", "catalogue", "centre", "colour", "favour", "grey", "honour", "labelled", "modelled", "modelling",
    "neighbour", "normalis", "optimis", "organis", "recognis", "summaris", "travelled", "unlabelled",
)  # fmt: skip

# regular expressions of what prose must not say, and why
PHRASES = {
    r"\bnobody vouches\b": "say 'untrusted'",
    r"\bspoi(l|ls|lt|led)\b": "say 'mutate' or 'damage'",
    r"\b(forgets|forgot)\b": "a material or program does not forget: say what it omits or loses",
    r"\bwhoever dies\b": "say 'even if workers fail'",
    r"\bwhat (those|it) (are|is) worth\b": "say 'how accurate'",
    r"\b(arrows?|rooms?) (between|of|to|may|must)\b": "say 'package' and 'layer'",
    r"\bpolynomial of Bernstein\b": "say 'Bernstein polynomial'",
    r"\bstarves?\b": "say 'converges too slowly'",
    r"\bleft aside\b": "say 'ignored'",
    r"\bminds that\b": "say who wrote it",
    r"(?<![\w.\])/$-])\.\d+(?![\w.]*[/\w])": "write the leading zero, 0.5",
    r"\b(" + "|".join(BRITISH) + r")\w*\b": "write American English",
}
# exceptions: keys of the course's scenes, names of published files and of the public API
ALLOWED = re.compile(r"`[^`]*`|\"[^\"]*\"|https?://\S+|\b\w*[._/=]\w+\S*|\b[A-Z]\w*Colour\w*|--\S+")

SOURCES = ("src/gonio",)
DOCUMENTS = (
    *("README.md", "CONTRIBUTING.md", "CHANGELOG.md"),
    *("docs/*.md", "docs/models/*.md", "docs/course/*.md", "examples/*/*.md"),
)


def names(tree: ast.AST) -> Iterator[tuple[int, str]]:
    """Every name that a file defines, with its line."""
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            yield node.lineno, node.name
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            yield node.lineno, node.id
        elif isinstance(node, ast.arg):
            yield node.lineno, node.arg


def prose_of_code(text: str, tree: ast.AST) -> Iterator[tuple[int, str]]:
    """Docstrings and comments, line by line."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef) and node.body:
            first = node.body[0]
            if (
                isinstance(first, ast.Expr)
                and isinstance(first.value, ast.Constant)
                and isinstance(first.value.value, str)
            ):
                lines = text.splitlines()[first.lineno - 1 : first.end_lineno]
                yield from ((first.lineno + i, line) for i, line in enumerate(lines) if not line.startswith(" " * 8))
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == tokenize.COMMENT and "noqa" not in token.string and "type:" not in token.string:
            yield token.start[0], token.string


def prose_of_document(text: str) -> Iterator[tuple[int, str]]:
    """The lines of a document without its listings and tables of code."""
    fenced = False
    for number, line in enumerate(text.splitlines(), 1):
        if line.startswith("```"):
            fenced = not fenced
        elif not fenced and not line.startswith("    "):
            yield number, line


def findings() -> Iterator[str]:
    """FILE:LINE: the text found there, and what to write instead."""
    for folder in SOURCES:
        for path in sorted((ROOT / folder).rglob("*.py")):
            text = path.read_text(encoding="utf-8")
            tree = ast.parse(text)
            for line, name in names(tree):
                if name.lstrip("_") in NAMES:
                    yield f"{path.relative_to(ROOT)}:{line}: name '{name}': write {NAMES[name.lstrip('_')]}"
            yield from judged(path, prose_of_code(text, tree))
    for pattern in DOCUMENTS:
        for path in sorted(ROOT.glob(pattern)):
            yield from judged(path, prose_of_document(path.read_text(encoding="utf-8")))


def judged(path: Path, prose: Iterator[tuple[int, str]]) -> Iterator[str]:
    """The findings among lines of prose."""
    for number, line in prose:
        plain = ALLOWED.sub(" ", line)
        for pattern, advice in PHRASES.items():
            if match := re.search(pattern, plain, re.IGNORECASE):
                yield f"{path.relative_to(ROOT)}:{number}: '{match[0].strip()}': {advice}"


def main() -> int:
    """Print every finding; returns 1 if there is any."""
    lines = list(findings())
    print("\n".join(lines) if lines else "words: nothing to report")
    return bool(lines)


if __name__ == "__main__":
    sys.exit(main())
