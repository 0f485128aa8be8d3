"""The tasks of a sheet: which file belongs to which, what is left alone, and what a folder lacks."""

from __future__ import annotations

import json
import re
from pathlib import Path

import gonio as go
import numpy as np
from gonio.check import sheet
from gonio.pictures import images

from .solutions import Table

PAGE = Path(__file__).parents[2] / "docs/check.md"
LISTED = re.compile(r"^\| (hw4|lab2) \| (.+?) \| (\d+) \| (.+) \|$", re.MULTILINE)
NAME = re.compile(r"`([\w-]+\.\w+)`")
MATTE = {"type": "matte", "albedo": [0.8, 0.3, 0.2]}
SCENE = {
    "output": {"filename": "rows.png"},
    "sampler": {"type": "independent", "samples": 4},
    "camera": {
        "type": "pinhole",
        "transform": {"position": [0, 0, 4], "lookAt": [0, 0, 0], "up": [0, 1, 0]},
        "verticalFov": 45,
        "film": {"size": [48, 48]},
    },
    "integrator": {"type": "directSampleLight"},
    "scene": {
        "shapes": [{"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": MATTE}],
        "lights": [{"type": "directionalLight", "direction": [-1, -1, -4], "energy": 3}],
    },
}  # fmt: skip


def test_the_page_lists_every_task_with_names_that_fit() -> None:
    listed = LISTED.findall(PAGE.read_text(encoding="utf-8"))
    assert [(name, task, float(points)) for name, task, points, _ in listed] == [
        (name, task.name, float(task.points)) for name, tasks in sheet.SHEETS.items() for task in tasks
    ]
    for name, task, _, words in listed:
        examples = NAME.findall(words)
        assert examples
        for example in examples:
            owner = sheet.task_of(sheet.SHEETS[name], Path(example))
            assert owner is not None and owner.name == task, example


def test_sources_and_documents_are_left_alone(tmp_path: Path) -> None:
    for name in ("E.cpp", "E_avg.pdf", "E.vcxproj"):
        (tmp_path / name).write_text("int main() {}")
    report = go.check(tmp_path, sheet="hw4")
    assert report.exit_code == 1  # missing, but nothing unreadable
    assert set(report.submissions[0].others) == {"E.cpp", "E_avg.pdf", "E.vcxproj"}
    assert {mark.finding.status for mark in report.submissions[0].marks} == {"not handed in"}


def test_the_split_sum_is_judged_as_the_sum_of_its_channels(tmp_path: Path) -> None:
    def status(change: str) -> str:
        E = Table(change=change).picture()
        A = (0.7 * E).astype(np.uint8)
        both = np.stack([A, E - A, 0 * A], axis=2)
        (tmp_path / "split-sum.png").write_bytes(images.png_bytes(both))
        marks = go.check(tmp_path, sheet="hw4").submissions[0].marks
        return next(mark.finding.status for mark in marks if mark.finding.name)

    assert status("") == "right" and status("no G") == "wrong"


def test_a_picture_without_a_task_is_compared_with_the_scene_of_its_name(tmp_path: Path) -> None:
    scene, work = tmp_path / "scenes/two-rows", tmp_path / "work"
    scene.mkdir(parents=True)
    work.mkdir()
    (scene / "scene.json").write_text(json.dumps(SCENE))
    images.write(work / "two-rows.png", go.render(scene, spp=4))
    submission = go.check(work, sheet="hw4", scene=tmp_path / "scenes").submissions[0]
    mark = next(mark for mark in submission.marks if mark.finding.name)
    assert mark.finding.passed and mark.points == 0.0 and not submission.others
    assert go.check(work, sheet="hw4").submissions[0].others == ("two-rows.png",)
