"""The software bill of materials."""

from __future__ import annotations

import importlib.util
import json
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[1]
SPEC = importlib.util.spec_from_file_location("bill", ROOT / "tools" / "bill.py")
assert SPEC is not None and SPEC.loader is not None
bill = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(bill)


def test_the_bill_lists_every_requirement_with_version_and_license() -> None:
    found = bill.bill()
    assert found["bomFormat"] == "CycloneDX" and found["metadata"]["component"]["name"] == "gonio"
    parts = {part["name"]: part for part in found["components"]}
    wanted = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["dependencies"]
    for line in wanted:
        requirement = bill.Requirement(line)
        if requirement.marker is None or requirement.marker.evaluate():
            part = parts[bill.key(requirement.name)]
            assert requirement.specifier.contains(part["version"]) and part["licenses"]
            assert part["purl"] == f"pkg:pypi/{part['name']}@{part['version']}"
    assert {"three", "drjit", "pydantic-core"} <= set(parts)  # also what they require, and what the page contains


def test_every_reference_of_the_bill_is_a_component() -> None:
    found = bill.bill()
    known = {part["bom-ref"] for part in found["components"]} | {found["metadata"]["component"]["bom-ref"]}
    assert len(known) == len(found["components"]) + 1
    for one in found["dependencies"]:
        assert {one["ref"], *one["dependsOn"]} <= known
    assert json.loads(json.dumps(found)) == found
