"""Lines of a shader: comments, and statements broken where they are long."""

from __future__ import annotations

INDENT = "    "
COLUMNS = 100


def comment(doc: str) -> list[str]:
    """A docstring as a comment."""
    return [f"// {line}".rstrip() for line in doc.strip().splitlines()]


def wrap(line: str, indent: str, hang: str = INDENT) -> list[str]:
    """A statement in lines of at most `COLUMNS` characters, broken where the least is torn apart.

    hang  what all lines but the first are indented by besides
    """
    text = indent + line
    cut = _break(text) if len(text) > COLUMNS else None
    return [text] if cut is None else [text[:cut].rstrip(), *wrap(text[cut:].lstrip(), indent + hang, "")]


def _break(text: str) -> int | None:
    """Where to break: at the shallowest operator or comma before the last column, the last of those."""
    depth, best = 0, None
    for i, c in enumerate(text[: COLUMNS + 1]):
        if c in "([{":
            depth += 1
        elif c in ")]}":
            depth -= 1
        if i < len(text) - len(text.lstrip()) + 8:
            continue
        place_ = None
        if c == "," and i < COLUMNS:
            place_ = i + 1
        elif c == " " and text[i + 1 : i + 3] in ("+ ", "- ", "? ", ": ", "* ", "/ ", "&&", "||"):
            place_ = i
        if place_ is not None:
            loose = 0 if c == "," else 1 if text[i + 1] in "?:&|" else 2 if text[i + 1] in "+-" else 3
            rank = (depth, loose)
            if best is None or rank <= best[0]:
                best = (rank, place_)
    return best[1] if best else None


def common_head(parts: list[str]) -> str:
    """The inner material whose fields these are: "base" for self.base_eta, self.base_k, ..."""
    paths = [part.partition(".")[2] for part in parts if "." in part and "(" not in part]
    heads = {path.partition("_")[0] for path in paths if "_" in path}
    return heads.pop() if len(heads) == 1 and len(paths) == len(parts) and all("_" in p for p in paths) else ""
