"""`gonio capture` from the command line."""

from __future__ import annotations

import pytest
from gonio.cli import main


def gonio(*words: str) -> int:
    with pytest.raises(SystemExit) as ended:
        main(list(words))
    return int(ended.value.code or 0)
