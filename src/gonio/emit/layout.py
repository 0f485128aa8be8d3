"""Lines of a shader: comments, and statements broken where they are long."""

from __future__ import annotations

INDENT = "    "
COLUMNS = 100


def comment(doc: str, indent: str = "") -> list[str]:
    """A docstring as a comment."""
    return [f"{indent}// {line}".rstrip() for line in doc.strip().splitlines()]


def wrap(line: str, indent: str) -> list[str]:
    """A statement in lines of at most `COLUMNS` characters, broken where the least is torn apart."""
    text = indent + line
    if len(text) <= COLUMNS:
        return [text]
    cut = _break(text, COLUMNS)
    if cut is None:
        return [text]
    first, rest = text[:cut].rstrip(), text[cut:].lstrip()
    return [first, *_continued(rest, indent + INDENT)]


def _continued(rest: str, indent: str) -> list[str]:
    text = indent + rest
    if len(text) <= COLUMNS:
        return [text]
    cut = _break(text, COLUMNS)
    if cut is None:
        return [text]
    return [text[:cut].rstrip(), *_continued(text[cut:].lstrip(), indent)]


def _break(text: str, limit: int) -> int | None:
    """Where to break: at the shallowest operator or comma before the limit, the last of those."""
    depth, best = 0, None
    for i, c in enumerate(text[: limit + 1]):
        if c in "([{":
            depth += 1
        elif c in ")]}":
            depth -= 1
        if i < len(text) - len(text.lstrip()) + 8:
            continue
        place_ = None
        if c == "," and i < limit:
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
