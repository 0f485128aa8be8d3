"""A software bill of materials: the components of an installed Gonio, as CycloneDX 1.6 JSON.

    python tools/bill.py dist/gonio.cdx.json         # for the environment whose Python runs it

It lists Gonio and every package that it requires here, each with its version, its license and the hash of its RECORD,
which contains the hash of each file; and the packages in the page's script, from web/package-lock.json.
"""

from __future__ import annotations

import hashlib
import json
import re
import sys
from importlib.metadata import Distribution, distribution
from pathlib import Path
from typing import Any

from packaging.requirements import Requirement

ROOT = Path(__file__).parents[1]
NAME = "gonio"


def key(name: str) -> str:
    """The name of a package as package indices spell it."""
    return re.sub(r"[-_.]+", "-", name).lower()


def required(package: Distribution) -> list[str]:
    """The names of the packages that a package requires in this environment, without extras."""
    found = [Requirement(line) for line in package.requires or ()]
    return sorted({key(one.name) for one in found if one.marker is None or one.marker.evaluate({"extra": ""})})


def closure(name: str) -> dict[str, Distribution]:
    """A package and everything that it requires, by name. Raises PackageNotFoundError if one is not installed."""
    found: dict[str, Distribution] = {}
    left = [key(name)]
    while left:
        one = left.pop()
        if one not in found:
            found[one] = distribution(one)
            left += required(found[one])
    return dict(sorted(found.items()))


def license_of(package: Distribution) -> list[dict[str, Any]]:
    """The license as the package states it: an expression, else the text of a field or of a classifier."""
    about = package.metadata
    if expression := about.get("License-Expression"):
        return [{"expression": expression}]
    kinds = [line.rpartition(" :: ")[2] for line in about.get_all("Classifier") or () if line.startswith("License ::")]
    stated = (about.get("License") or "").strip().split("\n")[0]
    return [{"license": {"name": name}} for name in (kinds or [stated])[:1] if name]


def component(name: str, package: Distribution) -> dict[str, Any]:
    """A package as CycloneDX describes it."""
    version = package.version
    address = f"pkg:pypi/{name}@{version}"
    found: dict[str, Any] = {"type": "library", "bom-ref": address, "name": name, "version": version, "purl": address}
    if licenses := license_of(package):
        found["licenses"] = licenses
    if files := package.read_text("RECORD"):
        found["properties"] = [{"name": "record:sha256", "value": hashlib.sha256(files.encode()).hexdigest()}]
    return found


def scripts(lock: Path) -> list[dict[str, Any]]:
    """The packages that are compiled into the page's script."""
    packages = json.loads(lock.read_text())["packages"]
    found = []
    for path, about in packages.items():
        if path.startswith("node_modules/") and not about.get("dev"):
            name = path.rpartition("node_modules/")[2]
            address = f"pkg:npm/{name.replace('@', '%40')}@{about['version']}"
            one = {"type": "library", "bom-ref": address, "name": name, "version": about["version"], "purl": address}
            found.append(one | ({"licenses": [{"expression": about["license"]}]} if "license" in about else {}))
    return found


def bill() -> dict[str, Any]:
    """The bill of this environment. It names no time and no machine, so that equal environments give equal bills."""
    packages = closure(NAME)
    parts = {name: component(name, package) for name, package in packages.items()}
    own = parts.pop(NAME)
    inside = scripts(ROOT / "web" / "package-lock.json")
    reference = {name: part["bom-ref"] for name, part in {**parts, NAME: own}.items()}
    depends = {reference[name]: [reference[one] for one in required(package)] for name, package in packages.items()}
    depends[own["bom-ref"]] += [part["bom-ref"] for part in inside]
    return {
        "$schema": "http://cyclonedx.org/schema/bom-1.6.schema.json",
        "bomFormat": "CycloneDX",
        "specVersion": "1.6",
        "version": 1,
        "metadata": {"component": {**own, "type": "application"}},
        "components": [*parts.values(), *inside],
        "dependencies": [{"ref": ref, "dependsOn": sorted(on)} for ref, on in depends.items()],
    }


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(json.dumps(bill(), indent=1) + "\n")
