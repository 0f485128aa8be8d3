"""The assignment sheets of the courses, as tasks with points, and the results for submissions.

A file is assigned to the first task whose pattern matches its name. A file of values may state its parameters and its
frame in comments, `# model: oren-nayar(sigma=0.5)` and `# up: y`; the task prescribes the model and its terms. Code is
not run.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from ..errors import GonioError, InputError, did_you_mean
from . import pictures, samples, stated, tables
from .finding import ANOTHER, BY_HAND, MISSING, WRONG, Finding, unreadable
from .report import Mark, Report, Submission

PICTURES = (".png", ".exr", ".hdr", ".npz")
ROWS = (".csv", ".txt", ".tsv", ".dat")
LEFT_ALONE = (
    ".c", ".cc", ".cpp", ".cxx", ".cu", ".h", ".hpp", ".inl", ".py", ".ipynb", ".js", ".ts", ".java", ".rs", ".m",
    ".glsl", ".frag", ".vert", ".hlsl", ".wgsl", ".o", ".obj", ".exe", ".cmake", ".sln", ".vcxproj", ".json", ".toml",
    ".pdf", ".doc", ".docx", ".md", ".tex", ".html",
)  # fmt: skip
SPLIT = "A + B"  # the table of the split sum, which equals E: one channel, or A in red and B in green


@dataclass(frozen=True)
class Task:
    """One task of an assignment sheet.

    files  a regular expression for file names without suffix, in lower case
    model  the material of files of values, with the terms of the task; "" if the task has no such files
    forms  other models that represent the same material
    table  "E", "E_avg", "E, sampled by importance", or SPLIT; "" for a task without a table
    """

    name: str
    points: float
    files: str
    model: str = ""
    table: str = ""
    forms: tuple[str, ...] = ()


_METAL = "preset=Ag,alpha=0.25,fresnel=schlick"
HW4 = (
    Task("E_avg", 5, r"(^|.*[_\- ])e_?avg.*|.*average.*", table="E_avg"),
    Task("bonus 1: importance sampling", 10, r"ggx_e_lut|.*e.*(_is|importance).*", table="E, sampled by importance"),
    Task("E(mu)", 5, r"(.*_)?e(_?mu)?(_mc)?(_lut)?(_\d+)?|.*(^|_)emu.*", table="E"),
    Task("Kulla-Conty", 5, r".*kulla.*", f"kulla-conty(base=conductor({_METAL},masking=schlick-direct),color=sheet)"),
    Task(
        "PBR material",
        10,
        r".*(pbr|conductor|ggx).*",
        f"conductor({_METAL},masking=schlick-direct)",
        forms=("metal(edge=1,masking=schlick-direct)",),
    ),
    Task("bonus 2: split sum", 5, r".*(split|dfg).*", table=SPLIT),
)
LAB2 = (
    Task("Phong", 5, r"(?!.*blinn).*phong.*", "phong"),
    Task("Oren-Nayar", 4, r".*oren.*", "oren-nayar"),
    Task(
        "conductor, Beckmann",
        6,
        r"(?!.*dielectric).*beckmann.*",
        f"conductor({_METAL},ndf=beckmann,masking=smith-separable)",
    ),
    Task(
        "conductor, GGX",
        6,
        r"(?!.*dielectric).*(ggx|conductor).*",
        f"conductor({_METAL},ndf=ggx,masking=smith-separable)",
    ),
    Task("report", 4, r".*(report|readme|lab2|\u62a5\u544a).*"),
)
PICTURE = Task("picture", 0, "")  # a picture with the name of the scene that it shows
SHEETS = {"hw4": HW4, "lab2": LAB2}


def check(folder: Path, sheet: str, scenes: Path | None = None, up: str = "z") -> Report:
    """Judge a folder, or each folder of a class. Raises InputError for an unknown sheet or an empty folder.

    sheet   name of the assignment sheet, "hw4" or "lab2"
    scenes  a folder of scenes, or one scene; pictures are compared with the scene of the same name
    up      the axis along the normal in files that do not state it: "z", "y" or "x"
    """
    if sheet not in SHEETS:
        raise InputError(f"unknown sheet '{sheet}'", "--sheet", did_you_mean(sheet, list(SHEETS)))
    folders = _submissions(folder)
    return Report([_submission(one, SHEETS[sheet], scenes, up) for one in folders], sheet)


def _submissions(folder: Path) -> list[Path]:
    """The folder itself if it contains files, otherwise its subfolders."""
    entries = sorted(entry for entry in folder.iterdir() if not entry.name.startswith("."))
    if not entries:
        raise InputError("the folder is empty", str(folder), "give the folder of a submission, or of several")
    folders = [entry for entry in entries if entry.is_dir()]
    return [folder] if any(entry.is_file() for entry in entries) or not folders else folders


def _submission(folder: Path, tasks: tuple[Task, ...], scenes: Path | None, up: str) -> Submission:
    files = sorted(path for path in folder.rglob("*") if path.is_file() and not path.name.startswith("."))
    if not files:
        return Submission(folder.name, [Mark("", 0.0, unreadable(folder.name, "an empty folder"))])
    files_of: dict[str, list[Path]] = {task.name: [] for task in tasks}
    others: list[Path] = []
    for path in files:
        task = task_of(tasks, path)
        (others if task is None else files_of[task.name]).append(path)
    tables_of = {task.table: files_of[task.name] for task in tasks if task.table}
    if not tables_of.get("E", [0]) and tables_of.get("E, sampled by importance"):
        files_of["E(mu)"] = tables_of["E, sampled by importance"][:1]  # it solves this task, too
    own = _own_table(files_of.get("E(mu)", []))
    marks = [
        Mark(task.name, task.points, one)
        for task in tasks
        for one in _judged(task, files_of[task.name], own, scenes, up)
    ]
    shown = [path for path in others if path.suffix.lower() in PICTURES and _scene_of(path, scenes) is not None]
    marks += [Mark(PICTURE.name, 0.0, one) for path in shown for one in _judged(PICTURE, [path], own, scenes, up)]
    left = [path for path in others if path not in shown]
    return Submission(folder.name, marks, tuple(str(path.relative_to(folder)) for path in left))


def task_of(tasks: tuple[Task, ...], path: Path) -> Task | None:
    """The first task whose pattern matches a file's name; None if there is none, or if the task is a table and the file
    is a source file or document."""
    task = next((one for one in tasks if re.fullmatch(one.files, path.stem.lower())), None)
    return None if task is not None and task.table and path.suffix.lower() in LEFT_ALONE else task


def _own_table(files: list[Path]) -> tables.Table | None:
    for path in files:
        try:
            return tables.read(path)
        except GonioError:
            continue
    return None


def _judged(task: Task, files: list[Path], own: tables.Table | None, scenes: Path | None, up: str) -> Iterator[Finding]:
    """One finding per file of a task, or a finding of the status MISSING for a task without files."""
    if not files:
        yield Finding("", "", MISSING)
    for path in files:
        try:
            yield _one(task, path, own, scenes, up)
        except GonioError as error:
            yield unreadable(path.name, error.what, error.hint)


def _one(task: Task, path: Path, own: tables.Table | None, scenes: Path | None, up: str) -> Finding:
    """The finding for one file of a task. Raises InputError if the file cannot be read."""
    suffix = path.suffix.lower()
    scene = _scene_of(path, scenes)
    if task.table == SPLIT and scene is not None and suffix in PICTURES:
        return pictures.check(path, scene)  # a rendering that uses the split sum
    if task.table and suffix in PICTURES:
        return _table(task, path, own)
    if task.table:
        raise InputError(f"a '{suffix}' given, a picture of the table expected", path.name, "give the .png")
    if task.model and suffix in ROWS:
        return _values(task, path, up)
    if suffix in PICTURES and scene is not None:
        return pictures.check(path, scene)
    note = "code is not run from a folder: use gonio check FILE.py:CLASS MODEL" if suffix == ".py" else ""
    return Finding(path.name, "", BY_HAND, (note,) if note else ())


def _values(task: Task, path: Path, up: str) -> Finding:
    """The finding for values of f, compared with the task's model with the parameters stated in the file."""
    up = stated.comments(path).get("up", up)
    try:
        asked = stated.for_task(path, (task.model, *task.forms))
    except stated.AnotherModelError as error:
        return Finding(path.name, ANOTHER, WRONG, remark=error.what)
    rows = samples.read(path, up)
    if why := stated.degenerate(asked.material, rows.wo, rows.wi, samples.ACCURACY):
        raise InputError(why, path.name, "hand in values for other parameters")
    return samples.check(path, asked, up)


def _table(task: Task, path: Path, own: tables.Table | None) -> Finding:
    table = tables.read(path, channels=2 if task.table == SPLIT else 1)
    if task.table == "E_avg":
        return tables.check_average(table, own)
    return tables.check(table, sampled=task.table == "E, sampled by importance")


def _scene_of(path: Path, scenes: Path | None) -> Path | None:
    """The scene with the name of a picture; None if there is none."""
    if scenes is None:
        return None
    if (scenes / "scene.json").exists():
        return scenes
    return next((one for one in (scenes / path.stem, scenes / path.stem.lower()) if one.is_dir()), None)
