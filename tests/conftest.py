"""What every test shares: the folder of helpers on the path, and precision put back after each test."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))  # `sphere`, `materials`

from gonio import ops


@pytest.fixture(autouse=True)
def precision_restored() -> Iterator[None]:
    """No test may leave another precision behind."""
    yield
    ops.set_precision("float32")
