"""The course: every page has its parts, its commands and programs run in the order in which they stand there, and the
Chinese page shows the same formulas, listings and pictures as the English one."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from gonio import OrenNayar, cli
from gonio.check.mistakes import f_of

ROOT = Path(__file__).parents[2]
COURSE = ROOT / "docs" / "course"
ENGLISH = sorted(page for page in COURSE.glob("*.md") if not page.name.endswith(".zh.md"))
PAGES = [page for page in ENGLISH if page.stem != "README"]
PARTS = {
    ".md": ("**Question.**", "## Derivation", "## Run it", "![", "**What to look for.**", "## Check your own code"),
    ".zh.md": ("**问题。**", "## 推导", "## 运行", "![", "**看点。**", "## 检查自己的结果"),
}
STEP = re.compile(r"^```python ([\w.]+)\n(.*?)^```$|^    (gonio [^\n]*)$", re.DOTALL | re.MULTILINE)
EXIT = re.compile(r"#.*exit code (\d)")
READ_COMMANDS_FILES = {"l17-storing"}  # pages with a program that reads what a command above it has written
SHARED = re.compile(
    r"^```.*?^```$|^    \S[^\n]*$|\$\$.*?\$\$|(?<=\]\()[^)\s]+\.(?:svg|png|jpg|csv)(?=\))", re.DOTALL | re.MULTILINE
)


def chinese(page: Path) -> Path:
    return page.with_suffix(".zh.md")


def cheap(command: str) -> list[str]:
    """The words of a command after `gonio`, at a size that is enough to see that it runs."""
    words = [word for word in shlex.split(command, comments=True)[1:] if word != "--denoise"]
    for option, values in {"--spp": ("render", "study"), "--size": ("render", "study")}.items():
        if words[0] in values:
            if option in words:
                del words[words.index(option) : words.index(option) + 2]
            words += [option, "2" if option == "--spp" else "48x32"]
    if words[0] == "view" and not {"-o", "--export"} & {*words}:
        words += ["--export", "page.html"]
    if words[0] == "measure" and "--samples" not in words:
        words += ["--samples", "20000"]
    return words


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder, in which the repository's pages and scenes are found."""
    for name in ("examples", "docs"):
        (tmp_path / name).symlink_to(ROOT / name)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def _run(name: str, program: str) -> None:
    Path(name).write_text(program, encoding="utf-8")
    exec(compile(program, name, "exec"), {"__name__": name.removesuffix(".py")})


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_commands_and_programs_run_in_their_order(page: Path, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name, program, command in STEP.findall(page.read_text(encoding="utf-8")):
        if program:
            _run(name, program)
            continue
        expected = EXIT.search(command)
        code = cli.run(cheap(command))
        told = capsys.readouterr()
        assert code == int(expected[1] if expected else 0), f"{command}\n{told.out}{told.err}"
        assert "Error in " not in told.out  # a verdict, not a program that fails


@pytest.mark.sample(6)
@pytest.mark.parametrize(
    "page", [page for page in PAGES if page.stem not in READ_COMMANDS_FILES], ids=lambda page: page.stem
)
def test_programs_run(page: Path, folder: Path) -> None:
    programs = [(name, text) for name, text, _ in STEP.findall(page.read_text(encoding="utf-8")) if text]
    assert programs
    for name, program in programs:
        _run(name, program)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
@pytest.mark.parametrize("language", PARTS)
def test_a_task_has_its_parts(page: Path, language: str) -> None:
    text = page.with_suffix(language).read_text(encoding="utf-8")
    assert [part for part in PARTS[language] if part not in text] == []


@pytest.mark.parametrize("page", ENGLISH, ids=lambda page: page.stem)
def test_both_languages_show_the_same(page: Path) -> None:
    """Formulas, listings, pictures and tables of values; only prose is translated."""
    shown = [
        [re.sub(r"\s+#.*", "", part) for part in SHARED.findall(one.read_text(encoding="utf-8"))]
        for one in (page, chinese(page))
    ]
    assert shown[0] == shown[1]


@pytest.mark.parametrize("page", ENGLISH, ids=lambda page: page.stem)
def test_chinese_pages_link_to_chinese_pages(page: Path) -> None:
    links = re.findall(r"\]\(([\w-]+)\.md\)", chinese(page).read_text(encoding="utf-8"))
    assert [link for link in links if chinese(COURSE / f"{link}.md").exists() and link != page.stem] == []


@pytest.mark.parametrize("name", ["README.md", "README.zh.md"])
def test_the_overview_lists_every_page(name: str) -> None:
    text = (COURSE / name).read_text(encoding="utf-8")
    suffix = name.removeprefix("README")
    assert [page.stem for page in PAGES if f"({page.stem}{suffix})" not in text] == []


def test_every_picture_is_shown() -> None:
    text = "".join(page.read_text(encoding="utf-8") for page in ENGLISH)
    assert [path.name for path in (COURSE / "pictures").iterdir() if f"pictures/{path.name}" not in text] == []


def test_reference_values_of_a_material_are_those_of_the_code() -> None:
    stored = np.loadtxt(COURSE / "values/oren-nayar.csv", delimiter=",")
    np.testing.assert_allclose(stored[:, 6:], f_of(OrenNayar(), stored[:, :3], stored[:, 3:6]), rtol=1e-6)


@pytest.mark.slow
def test_all_reference_values_are_those_of_the_code() -> None:
    command = [sys.executable, ROOT / "docs/make_course_values.py", "--check"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
