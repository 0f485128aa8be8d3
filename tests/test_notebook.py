"""The notebooks run from top to bottom."""

from __future__ import annotations

from pathlib import Path

import nbclient
import nbformat
import pytest

EXAMPLES = Path(__file__).parents[1] / "examples"


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_the_lab_sheet_runs_from_top_to_bottom() -> None:
    assert len(pictures_of("lab-sheet.ipynb")) >= 11


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_the_photographed_sphere_runs_from_top_to_bottom() -> None:
    assert len(pictures_of("photographed-sphere.ipynb")) == 3


def pictures_of(name: str) -> list[object]:
    """The pictures that a notebook shows when it is run."""
    notebook = nbformat.read(EXAMPLES / name, as_version=4)
    resources = {"metadata": {"path": str(EXAMPLES)}}
    nbclient.NotebookClient(notebook, timeout=240, resources=resources).execute()
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    return [one for one in outputs if {"image/jpeg", "image/png"} & set(one.get("data", {}))]
