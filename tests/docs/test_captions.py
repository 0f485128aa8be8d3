"""examples/caption.py writes each name below its ball."""

from __future__ import annotations

import importlib.util
import json
import shlex
from pathlib import Path
from types import ModuleType

import gonio as go
import numpy as np
import pytest
from PIL import Image

EXAMPLES = Path(__file__).parents[2] / "examples"
CAPTIONED = [
    page for page in sorted(EXAMPLES.glob("*/README.md")) if "examples/caption.py" in page.read_text(encoding="utf-8")
]


@pytest.fixture(scope="module")
def caption() -> ModuleType:
    spec = importlib.util.spec_from_file_location("caption", EXAMPLES / "caption.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_balls_are_found_where_the_camera_sees_them(caption: ModuleType, scene: Path) -> None:
    """The lit pixels of each ball alone lie about its projected center, from a camera that is tilted."""
    described = json.loads((scene / "scene.json").read_text())
    described["camera"]["transform"] = {"position": [1.0, 2.0, 7.0], "lookAt": [0.3, -0.2, 0.0], "up": [0, 1, 0]}
    described["camera"]["film"]["size"] = [120, 80]
    described["scene"]["lights"] = [{"type": "environmentLight", "radiance": [1.0, 1.0, 1.0]}]
    ball = described["scene"]["shapes"][0] | {"material": {"type": "matte", "albedo": 0.1}, "radius": 0.3}
    for center in ([-1.2, 0.4, 0.5], [1.1, -0.6, -0.5]):
        described["scene"]["shapes"] = [ball | {"center": center}]
        (scene / "scene.json").write_text(json.dumps(described))
        picture = np.asarray(go.render(scene, spp=4))
        y, x = np.nonzero(picture[..., 0] < 0.5)  # darker than the sky
        (found,) = caption.projected(np.array([center]), described["camera"], 120, 80)
        assert np.allclose(found, [x.mean() + 0.5, y.mean() + 0.5], atol=0.5)


@pytest.mark.parametrize("page", CAPTIONED, ids=lambda page: page.parent.name)
def test_the_command_of_a_page_names_the_balls_of_its_scene(page: Path, caption: ModuleType) -> None:
    """Run as printed on a blank picture, it writes into it, and its names fit the scene."""
    (line,) = [
        x for x in page.read_text(encoding="utf-8").splitlines() if x.startswith("    python examples/caption.py")
    ]
    _, _, file, _, *words = shlex.split(line)
    rows = words[words.index("--rows") + 1 :] if "--rows" in words else []
    names = words[: words.index("--rows")] if "--rows" in words else words
    described = json.loads((EXAMPLES.parent / file).read_text())
    width, height = described["camera"]["film"]["size"]
    rows = [row for row in rows if not row.startswith("--")]
    blank = Image.new("RGB", (width, height))
    written = np.asarray(caption.caption(described, blank, names, rows, "--outlines" in words))
    assert written.shape == (height, width, 3) and (written > 200).sum() > 100 * sum(map(bool, names))
    with pytest.raises(SystemExit, match="names for"):
        caption.caption(described, blank, [*["x"] * 99], rows, False)
