"""The layout of shader text: comments, and long statements broken into lines."""

from __future__ import annotations

INDENT = "    "
COLUMNS = 100


def comment(doc: str) -> list[str]:
    """A docstring as a comment."""
    return [f"// {line}".rstrip() for line in doc.strip().splitlines()]


def wrap(line: str, indent: str, hang: str = INDENT) -> list[str]:
    """A statement in lines of at most `COLUMNS` characters, broken at the operators of lowest precedence.

    indent  indentation of the first line
    hang    additional indentation of all other lines
    """
    text = indent + line
    cut = _break(text) if len(text) > COLUMNS else None
    return [text] if cut is None else [text[:cut].rstrip(), *wrap(text[cut:].lstrip(), indent + hang, "")]


def _break(text: str) -> int | None:
    """The position of a line break: at the last of the least nested operators or commas before the last column."""
    depth, best = 0, None
    for i, c in enumerate(text[: COLUMNS + 1]):
        if c in "([{":
            depth += 1
        elif c in ")]}":
            depth -= 1
        if i < len(text) - len(text.lstrip()) + 8:
            continue
        cut = None
        if c == "," and i < COLUMNS:
            cut = i + 1
        elif c == " " and text[i + 1 : i + 3] in ("+ ", "- ", "? ", ": ", "* ", "/ ", "&&", "||"):
            cut = i
        if cut is not None:
            loose = 0 if c == "," else 1 if text[i + 1] in "?:&|" else 2 if text[i + 1] in "+-" else 3
            rank = (depth, loose)
            if best is None or rank <= best[0]:
                best = (rank, cut)
    return best[1] if best else None


def common_head(parts: list[str]) -> str:
    """The inner material to which these fields belong: "base" for self.base_eta, self.base_k, ..."""
    paths = [part.partition(".")[2] for part in parts if "." in part and "(" not in part]
    heads = {path.partition("_")[0] for path in paths if "_" in path}
    return heads.pop() if len(heads) == 1 and len(paths) == len(parts) and all("_" in p for p in paths) else ""
