"""The one family of errors: its text, its exit codes, its hints."""

from __future__ import annotations

import gonio as go
import pytest
from gonio.errors import did_you_mean


def test_message_has_place_then_fault_then_hint() -> None:
    error = go.GonioError("3 given, 4 expected", "scene.json /a/b", "give 4")
    assert str(error) == "scene.json /a/b: 3 given, 4 expected\n  hint: give 4"


def test_a_number_that_fills_the_screen_is_cut() -> None:
    told = str(go.InputError(f"spp is {10**400}, expected at most {2**31}", "--spp"))
    assert told == "--spp: spp is 10000000000000000000... (401 digits), expected at most 2147483648"


def test_message_without_place_or_hint_is_the_fault_alone() -> None:
    assert str(go.GonioError("disk full")) == "disk full"
    assert str(go.GonioError("disk full", hint="free some")) == "disk full\n  hint: free some"


def test_exit_codes_tell_bad_input_from_a_fault_of_the_machine() -> None:
    assert go.InputError("x").code == 2 and go.MachineError("x").code == 3


def test_bad_input_is_a_value_error_too() -> None:
    with pytest.raises(ValueError, match="negative"):
        raise go.InputError("negative")
    assert issubclass(go.InputError, go.GonioError) and issubclass(go.MachineError, go.GonioError)
    assert issubclass(go.GonioWarning, UserWarning)


def test_near_names_are_suggested_and_far_ones_listed() -> None:
    assert did_you_mean("beckman", ["ggx", "beckmann"]) == "did you mean 'beckmann'?"
    assert did_you_mean("xyz", ["ggx", "beckmann"]) == "known: beckmann, ggx"


def test_parts_of_an_error_can_be_read() -> None:
    error = go.InputError("what", "where", "hint")
    assert (error.what, error.where, error.hint) == ("what", "where", "hint")
