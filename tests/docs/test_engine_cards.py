"""The cards of engines: the pages are those of the stored figures, which the engines' own renderers confirm."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import browser

sys.path.append(str(Path(__file__).parents[2] / "docs"))
from engine_cases import engines

DOCS = Path(__file__).parents[2] / "docs"
FOLDER = DOCS / "report-cards" / "engines"
CARDS = json.loads((FOLDER / "cards.json").read_text())
ROUGHNESSES, COSINES = (0.1, 0.25, 0.5, 0.75, 1.0), (0.05, 0.1, 0.25, 0.5, 0.75, 1.0)
PACKAGES = {engine.page: package for package, engine in engines().items()}
ROW = re.compile(r"^(.*), roughness ([\d.]+), n\.v ([\d.]+): ([\d.]+)$", re.MULTILINE)


@pytest.mark.slow
def test_pages_are_made_of_the_stored_figures() -> None:
    done = subprocess.run([sys.executable, DOCS / "make_engine_cards.py", "--check"], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def test_page_of_the_explorer_is_made_of_its_stored_verdicts() -> None:
    done = subprocess.run([sys.executable, DOCS / "make_explorer_card.py", "--check"], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def test_polynomial_of_bevy_accounts_for_its_white_metal() -> None:
    for figures in (release["trials"] for release in CARDS["bevy"].values()):
        for name, expected in figures.items():
            if name.startswith("expected_"):
                assert figures[f"shader_{name.removeprefix('expected_')}"] == pytest.approx(expected, abs=0.01)


def test_figures_of_the_thread_about_rough_metals_are_met() -> None:
    stated = {"0.5_0.5": (0.90, 1.00), "0.75_0.5": (0.84, 1.00), "1_0.5": (0.72, 0.94), "1_1": (0.58, 0.89)}
    before, after = (CARDS["three"][version]["trials"] for version in ("0.185.1", "0.187.0"))
    for place, (old, new) in stated.items():
        assert abs(before[f"thread_{place}"] - old) < 0.01 and abs(after[f"thread_{place}"] - new) < 0.01


def test_table_of_the_same_size_from_edge_to_edge_mends_white_metal() -> None:
    figures = CARDS["three"]["0.187.0"]["trials"]
    assert figures["own"] == pytest.approx(figures["exact_end"] / figures["texel"], abs=1e-3)
    assert figures["texel"] == pytest.approx(figures["exact_texel"], abs=1e-3)  # its entries are right
    assert abs(1.0 - figures["edges_16"]) < 0.05 * abs(1.0 - figures["own"])


def test_causes_account_for_the_difference_of_the_builds_of_three() -> None:
    for version, apart in {"0.185.1": {"plain", "weight", "sheen", "both", "film"}, "0.187.0": {"both"}}.items():
        figures = CARDS["three"][version]["trials"]
        assert all(figures[f"tsl_{name}"] > 1e-4 for name in apart)
        assert figures["tsl_left"] < 1e-5  # with the lines named as causes changed


def _printed_by(output: Path) -> tuple[str, str]:
    """Page and release of an output."""
    page, _, version = output.stem.replace("-furnace-", " ").partition(" ")
    return page, version


@pytest.mark.parametrize("output", sorted((FOLDER / "programs").glob("*.txt")), ids=lambda path: path.stem)
def test_renderer_of_the_engine_returns_our_figures(output: Path) -> None:
    page, version = _printed_by(output)
    furnaces = CARDS[PACKAGES[page]][version]["furnaces"]
    rows = ROW.findall(output.read_text())
    assert len(rows) >= 8
    for title, roughness, cosine, albedo in rows:
        ours = furnaces[title][ROUGHNESSES.index(float(roughness))][COSINES.index(float(cosine))]
        assert float(albedo) == pytest.approx(ours, abs=1e-3), (title, roughness, cosine)


@pytest.mark.slow
@pytest.mark.parametrize("output", sorted((FOLDER / "programs").glob("*.txt")), ids=lambda path: path.stem)
def test_program_without_gonio_prints_what_is_stored(output: Path) -> None:
    """With the packages of npm in the folder GONIO_ENGINES, laid out as `make_engine_cards.py` reads them."""
    given = os.environ.get("GONIO_ENGINES")
    if not given:
        pytest.skip("NOT TRIED: GONIO_ENGINES names no folder with the packages of engines")
    if browser.missing():
        pytest.skip(browser.missing())
    import engine_programs
    import make_engine_cards

    page, version = _printed_by(output)
    package = PACKAGES[page]
    found = make_engine_cards.releases(Path(given), {package}).get(package, [])
    release = next((one for one in found if one.version == version), None)
    if release is None:
        pytest.skip(f"NOT TRIED: no {package} {version} in {given}")
    text = engine_programs.printed(release, engines()[package].programs[0])
    number = re.compile(r"(?<=: )-?\d+\.\d+|(?<= )\d\.\d{4}")
    assert number.sub("#", text) == number.sub("#", output.read_text())
    for now, stored in zip(number.findall(text), number.findall(output.read_text()), strict=True):
        assert float(now) == pytest.approx(float(stored), abs=2e-3)


def test_every_failure_has_a_size_and_a_cause() -> None:
    for path in FOLDER.glob("*.md"):
        for line in re.findall(r"^- \*\*.*?(?=^- |^#|\Z)", path.read_text(), re.MULTILINE | re.DOTALL):
            assert re.search(r"\d", line.partition(":")[2]) and "Cause:" in line.replace("\n  ", " "), line
