"""Parameters of a scene found again in a picture of it."""

from __future__ import annotations

import json
from pathlib import Path

import gonio as go
import numpy as np
import pytest
from gonio import cli
from gonio.errors import InputError
from gonio.instruments.pictures import fit_picture

SCENE = {
    "output": {"filename": "a.npz"},
    "sampler": {"type": "independent", "samples": 64},
    "camera": {
        "type": "pinhole",
        "transform": {"position": [0, 1.5, 5], "lookAt": [0, 0.8, 0], "up": [0, 1, 0]},
        "verticalFov": 35,
        "film": {"size": [32, 24]},
    },
    "integrator": {"type": "path", "maxDepth": 3},
    "scene": {
        "shapes": [
            {
                "type": "sphere",
                "center": [0, 1, 0],
                "radius": 1,
                "material": {"type": "gonio-conductor", "preset": "Au", "alpha": 0.5},
            },
            {
                "type": "parallelogram",
                "base": [-4, 0, -4],
                "edge0": [0, 0, 8],
                "edge1": [8, 0, 0],
                "material": {"type": "gonio-lambert", "albedo": [0.5, 0.5, 0.5]},
            },
        ],
        "lights": [
            {"type": "spotLight", "position": [-3, 5, 3], "energy": [60, 60, 60]},
            {"type": "environmentLight", "radiance": [0.3, 0.35, 0.4]},
        ],
    },
}
TRUE = {"shapes.0.material.alpha": 0.25, "shapes.1.material.albedo": [0.6, 0.4, 0.2]}
FREE = ["shapes.0.material.alpha", "shapes.1.material"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A scene whose materials are set wrong, and a picture of the right ones."""
    folder = tmp_path_factory.mktemp("pictures")
    (folder / "scene.json").write_text(json.dumps(SCENE))
    go.render(folder, output=folder / "true.npz", overrides=TRUE, spp=256, seed=5)
    return folder


def test_width_and_colour_are_found_again(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["fit", "--from", folder / "true.npz", "--scene", folder / "scene.json", "--spp", 64, "--json"]
    words += ["-o", folder / "found.json", *(word for path in FREE for word in ("--free", path))]
    with pytest.raises(SystemExit) as ended:
        cli.main([str(word) for word in words])
    assert not ended.value.code
    about = json.loads(capsys.readouterr().out)
    values = {name: one["value"] for name, one in about["parameters"].items()}
    errors = np.array([one["error"] for one in about["parameters"].values()])
    true = [0.25, 0.6, 0.4, 0.2]
    assert list(values) == [FREE[0], *(f"shapes.1.material.albedo.{c}" for c in "rgb")]
    np.testing.assert_allclose([*values.values()], true, rtol=0.05)
    assert np.all(np.abs([*values.values()] - np.array(true)) < 4.0 * errors)
    assert about["losses"][-1] < 0.05 * about["losses"][0]
    assert json.loads((folder / "found.json").read_text())["materials"]["shapes.1.material"].startswith("lambert(")
    assert (folder / "found.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("free", "text"),
    [
        (["ball.alpha"], "names no material of a shape"),
        (["shapes.7.material"], "no shape 7"),
        (["shapes.0.material.alfa"], "no parameter 'alfa'"),
    ],
)
def test_a_path_that_leads_nowhere_is_refused(folder: Path, free: list[str], text: str) -> None:
    with pytest.raises(InputError, match=text):
        fit_picture(folder / "true.npz", folder / "scene.json", free)


def test_a_picture_of_another_size_is_refused(folder: Path) -> None:
    with pytest.raises(InputError, match=r"true.npz: 32x24 pixels, 16x16 expected"):
        fit_picture(folder / "true.npz", folder / "scene.json", param={"/camera/film/size": [16, 16]})
    with pytest.raises(SystemExit) as ended:
        cli.main(["fit", str(folder / "true.npz")])
    assert ended.value.code == 2
