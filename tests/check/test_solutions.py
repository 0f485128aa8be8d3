"""`go.check` on right and wrong solutions: right ones pass, wrong ones fail, and the cause is named, or nothing is."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import gonio as go
import numpy as np
import pytest
from gonio.pictures import images

from . import solutions as of
from .solutions import Average, Conductor, OrenNayar, Phong, Table

SILVER = "eta=(0.15494,0.11648,0.13809),k=(4.8181,3.11562,2.1424),alpha=0.25,masking=smith-separable,fresnel=schlick"
MODELS = {
    OrenNayar: "oren-nayar(sigma=0.3,albedo=0.5)",
    Phong: "phong(kd=0.5,ks=0.3,p=32)",
    "ggx": f"conductor({SILVER},ndf=ggx)",
    "beckmann": f"conductor({SILVER},ndf=beckmann)",
}

RIGHT: dict[str, Any] = {
    "Oren-Nayar": OrenNayar(),
    "conductor, GGX": Conductor(),
    "conductor, Beckmann": Conductor("beckmann"),
    "Phong as L": Phong(),
    "E, k of the figures": Table(),
    "E, k of the text": Table(k="text"),
    "E, flip off": Table(flip=False),
    "1 - E": Table(change="1 - E", flip=False),
    "E by cosine-weighted directions": Table(cosine=True),
    "E_avg": Average(),
}

# The solution, and what the named cause must say; None where no cause may be named.
WRONG: dict[str, tuple[Any, str | None]] = {
    "Oren-Nayar, 1 / pi forgotten": (OrenNayar(change="no pi"), r"\bpi\b"),
    "Oren-Nayar, min and max": (OrenNayar(change="min and max"), "min and max"),
    "Oren-Nayar, sigma in degrees": (OrenNayar(change="sigma in degrees"), "degrees"),
    "Oren-Nayar, sigma for variance": (OrenNayar(change="sigma for variance"), "variance"),
    "Oren-Nayar, constants exchanged": (OrenNayar(change="constants exchanged"), "0.33 and 0.09"),
    "Oren-Nayar, no max": (OrenNayar(change="no max"), "without the max"),
    "Oren-Nayar, cosine of directions": (OrenNayar(change="cosine of directions"), "between wo and wi"),
    "Oren-Nayar, cosine twice": (OrenNayar(change="cosine twice"), "cos_i|cosine of wi"),
    "Oren-Nayar, albedo squared": (OrenNayar(change="albedo squared"), "albedo is squared|1 / 2"),
    "Oren-Nayar, sin^2": (OrenNayar(change="sine of alpha squared"), None),
    "Oren-Nayar, another sigma": (OrenNayar(sigma=0.4), None),
    "GGX, alpha squared": (Conductor(change="alpha squared"), "alpha"),
    "GGX, cos^2 in D": (Conductor(change="cos^2 in D"), r"cos\^2 in place of cos\^4"),
    "GGX, bracket not squared": (Conductor(change="bracket not squared"), "the square of .* is missing"),
    "GGX, k of the homework": (Conductor(change="k of the homework"), r"k = \(roughness \+ 1\)\^2 / 8"),
    "GGX, micro normal": (Conductor(change="micro normal"), "micro normal"),
    "GGX, one G1": (Conductor(change="one G1"), "one direction only"),
    "GGX, no G": (Conductor(change="no G"), "G is missing"),
    "GGX, F at n.o": (Conductor(change="F at n.o"), "F at n.o|the Fresnel term at the angle to the normal"),
    "GGX, no F": (Conductor(change="no F"), "F is missing"),
    "GGX, k forgotten": (Conductor(change="k forgotten"), "k is missing"),
    "GGX, power 4": (Conductor(change="power 4"), "power 4"),
    "GGX, no 4": (Conductor(change="no 4"), r"\b4\b"),
    "GGX, pi for 4": (Conductor(change="pi for 4"), "pi"),
    "GGX, no n.i": (Conductor(change="no n.i"), "n.i is missing|cosine of wi"),
    "GGX, h not normalized": (Conductor(change="h not normalized"), "half vector|F|D"),
    "GGX, clamped": (Conductor(change="clamped"), None),
    "GGX for Beckmann": ((Conductor("ggx"), "beckmann"), "ggx"),
    "Beckmann, alpha in the exponent": (Conductor("beckmann", change="alpha in the exponent"), "alpha"),
    "Phong, half vector": (Phong(change="half vector"), "n.h"),
    "Phong, kd over pi": (Phong(change="kd over pi"), "kd / pi"),
    "Phong, normalized": (Phong(change="normalized"), r"\(p \+ 2\) / \(2 pi\)"),
    "Phong, |v.r|": (Phong(change="no max"), "v.r"),
    "Phong, specular cosine": (Phong(change="specular cosine"), r"cosine \(n.l\) too"),
    "E, k = roughness / 2": (Table(k="roughness / 2"), "k = roughness / 2"),
    "E, alpha = roughness": (Table(change="alpha = roughness", k="text"), "alpha = roughness"),
    "E, cosine twice": (Table(change="cosine twice"), "cosine of the light is applied twice"),
    "E, no G": (Table(change="no G"), "G is missing"),
    "E, one G": (Table(change="one G"), "one direction only"),
    "E, no Jacobian": (Table(change="no jacobian"), "Jacobian"),
    "E, twice as large": (Table(change="times 2"), r"\b2 times"),
    "E, over pi": (Table(change="over pi"), "1 / pi"),
    "E, mu to the left": (Table(change="mu to the left"), "right to left"),
    "E, transposed": (Table(change="transposed"), "rows and columns"),
    "E, no cosine": (Table(change="no cosine"), None),
    "E_avg, 2 mu forgotten": (Average(lambda mu: 1.0 + 0.0 * mu), "2 mu is missing"),
    "E_avg, 2 forgotten": (Average(lambda mu: mu), "factor 2 is missing"),
    "E_avg, 4 / 3": (Average(lambda mu: 4.0 / 3.0 + 0.0 * mu), "4/3"),
    "E_avg, mu twice": (Average(lambda mu: 2.0 * mu**2), "mu is applied twice"),
}


def _judged(solution: Any, folder: Path) -> go.GonioError | Any:
    """The finding about a solution, by the file that its program would write."""
    model = ""
    if isinstance(solution, tuple):
        solution, model = solution
    if isinstance(solution, Table | Average):
        path = folder / "E.png"
        path.write_bytes(images.png_bytes(np.repeat(solution.picture()[..., None], 3, axis=2)))
        return go.check(path)
    f = solution(of.WO, of.WI)
    rows = np.column_stack([of.WO, of.WI, f])
    np.savetxt(folder / "f.csv", rows, fmt="%.6g", delimiter=",", header="wo wi f")
    kind = solution.ndf if isinstance(solution, Conductor) else type(solution)
    return go.check(folder / "f.csv", MODELS[model or kind])


@pytest.mark.sample(3)
@pytest.mark.parametrize("name", RIGHT)
def test_a_right_solution_passes(name: str, tmp_path: Path) -> None:
    finding = _judged(RIGHT[name], tmp_path)
    assert finding.status == "right", finding.lines()
    assert finding.exit_code == 0 and not finding.cause


@pytest.mark.sample(5)
@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_solution_fails_and_its_cause_is_named(name: str, tmp_path: Path) -> None:
    solution, cause = WRONG[name]
    finding = _judged(solution, tmp_path)
    assert finding.status == "wrong", finding.lines()
    assert finding.exit_code == 1
    if cause is None:
        assert not finding.cause or "differs from 1 only where" in finding.cause, finding.cause
    else:
        assert re.search(cause, finding.cause), finding.lines()


def test_most_causes_are_named() -> None:
    named = sum(cause is not None for _, cause in WRONG.values())
    assert len(RIGHT) >= 10 and len(WRONG) >= 40
    assert named >= 0.6 * len(WRONG)  # which causes, the test above says for each
