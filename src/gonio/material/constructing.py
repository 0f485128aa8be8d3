"""Names that constructors of materials accept besides the declared parameters: Mitsuba's names for the two widths.

go.Conductor(alpha_u=0.1, alpha_v=0.3)        is go.Conductor(alpha=(0.1, 0.3))
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from typing import Any

from ..errors import InputError

WIDTHS = ("alpha_u", "alpha_v")  # along x and along y


def with_pair(known: Mapping[str, object], given: Mapping[str, Any], where: str) -> dict[str, Any]:
    """The arguments with `alpha_u` and `alpha_v` as the pair `alpha`, if the material has `alpha` but not these names.

    known  the material's declared parameters
    given  the arguments of its constructor
    where  the name of the class, for errors
    Raises InputError if only one of the two is given, or if either is given together with `alpha`.
    """
    named = [name for name in WIDTHS if name in given and name not in known]
    if not named or "alpha" not in known:
        return dict(given)
    if len(named) == 1 or "alpha" in given:
        what = f"only {named[0]} given" if len(named) == 1 else "alpha given together with alpha_u and alpha_v"
        raise InputError(what, where, "give alpha_u and alpha_v, the widths along x and y, or alpha")
    pair = tuple(given[name] for name in WIDTHS)
    both = ",".join(pair) if all(isinstance(width, str) for width in pair) else pair
    return {**{name: value for name, value in given.items() if name not in WIDTHS}, "alpha": both}


def accepted(construct: Callable[..., None]) -> Callable[..., None]:
    """A constructor that also accepts `alpha_u` and `alpha_v`. If `preset` is passed as an argument, its error suggests
    the method `preset`."""

    @functools.wraps(construct)
    def __init__(self: Any, *args: Any, **given: Any) -> None:
        known, name = self.parameters(), type(self).__name__
        if "preset" in given and "preset" not in known and self.presets():
            hint = f"{name}.preset({given['preset']!r}, ...), or go.material({self.name!r}, preset=...)"
            raise InputError("a preset is not a parameter", name, hint)
        try:
            construct(self, *args, **with_pair(known, given, name))
        except InputError as error:
            preset = next((one for one in given.values() if isinstance(one, str) and one in self.presets()), "")
            if error.hint or not preset:
                raise
            raise InputError(error.what, error.where, f"{name}.preset('{preset}', ...)") from None

    return __init__
