"""Names that `gonio.ops` lacks are answered by the names that it has."""

from __future__ import annotations

import pytest
from gonio import ops


@pytest.mark.parametrize(
    ("name", "present"), [("max", "maximum"), ("select", "where"), ("length", "norm"), ("normalise", "normalize")]
)
def test_a_name_of_another_language_or_a_misspelt_one_gets_a_hint(name: str, present: str) -> None:
    with pytest.raises(AttributeError, match=f"gonio.ops has no '{name}'; .*'{present}'"):
        getattr(ops, name)


def test_every_name_that_is_offered_is_there() -> None:
    assert all(hasattr(ops, name) for name in ops.__all__)
    assert not hasattr(ops, "__wrapped__")
