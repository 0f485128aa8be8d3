"""The command line: exit codes, three-line errors, JSON, and a start that loads nothing heavy."""

from __future__ import annotations

import functools
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import gonio as go
import numpy as np
import pytest
from gonio import cli, llvm
from gonio.pictures import images

VERBS = tuple(cli.Verb.family.all())


def gonio(*arguments: object) -> int:
    """Run the command in this process; its exit code."""
    with pytest.raises(SystemExit) as caught:
        cli.main([str(argument) for argument in arguments])
    return int(caught.value.code or 0)


def failure(capsys: pytest.CaptureFixture[str], *arguments: object) -> str:
    """Run a command that has to fail on its input; what it says."""
    assert gonio(*arguments) == 2
    told = capsys.readouterr()
    assert "Traceback" not in told.err + told.out
    assert told.out == ""
    lines = told.err.strip().splitlines()
    assert 1 <= len(lines) <= 3 and lines[0].startswith("error: ")
    return told.err


# --- start and help ------------------------------------------------------------------------------------


def test_help_loads_nothing_heavy() -> None:
    program = (
        "import sys; from gonio import cli\n"
        "try: cli.main(['--help'])\n"
        "except SystemExit: pass\n"
        "heavy = ['mitsuba', 'drjit', 'numpy', 'matplotlib', 'pydantic', 'scipy', 'rich', 'importlib.metadata']\n"
        "print([m for m in heavy if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.stdout.strip().splitlines()[-1] == "[]"


@pytest.mark.slow
def test_rendering_loads_no_plotting(scene: Path) -> None:
    program = (
        "import sys; from gonio import cli\n"
        f"try: cli.main(['render', {str(scene)!r}, '-o', 'a.exr'])\n"
        "except SystemExit as end: assert not end.code, end.code\n"
        "print([m for m in ('matplotlib', 'scipy') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.stdout.strip().splitlines()[-1] == "[]", done.stderr


@pytest.mark.sample(4)
@pytest.mark.parametrize("verb", VERBS)
def test_every_verb_has_an_example(verb: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert gonio(verb, "--help") == 0
    text = capsys.readouterr().out
    assert re.search(rf"^ *gonio {verb}\b", text, re.MULTILINE), text


def test_help_groups_the_verbs(capsys: pytest.CaptureFixture[str]) -> None:
    assert gonio("--help") == 0
    text = capsys.readouterr().out
    for heading in ("Pictures:", "Materials:", "Support:", "Exit codes:"):
        assert heading in text
    assert "\x1b" not in text  # no terminal, no colours
    assert text.index("  render ") < text.index("  study ") < text.index("  plot ") < text.index("  schema ")
    assert all(re.search(rf"^  {verb}  ", text, re.MULTILINE) for verb in VERBS)


def test_the_version_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    import gonio as package

    assert gonio("--version") == 0
    assert capsys.readouterr().out == f"gonio {package.__version__}\n"


SHEEN = '''
from dataclasses import dataclass
from typing import Annotated
from typer import Option
from gonio.cli import verb

@dataclass(frozen=True)
class Fabric:
    weave: Annotated[str, Option(help="How it is woven.")] = "twill"
    threads: Annotated[int, Option("-n", metavar="N")] = 8

@verb("Cloth")
def sheen(name: str, *, loud: bool = False, fabric: Fabric) -> None:
    """Print a fabric.

    Examples:
      gonio sheen wool --weave satin
    """
    print(name, loud, fabric)
'''


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """A folder with an installed package that brings a verb."""
    folder = tmp_path / "site"
    (folder / "sheen-1.dist-info").mkdir(parents=True)
    (folder / "sheen-1.dist-info/METADATA").write_text("Metadata-Version: 2.1\nName: sheen\nVersion: 1\n")
    (folder / "sheen-1.dist-info/entry_points.txt").write_text("[gonio.verbs]\nsheen = sheen_package:sheen\n")
    (folder / "sheen_package.py").write_text(SHEEN)
    return folder


def _in_another_process(folder: Path, *arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    path = os.pathsep.join([str(folder), *filter(None, [os.environ.get("PYTHONPATH")])])
    return subprocess.run(
        [sys.executable, "-m", "gonio", *arguments],
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONPATH": path, **environment},
    )


@pytest.mark.slow
def test_a_package_adds_a_verb_by_one_file(package: Path) -> None:
    done = _in_another_process(package, "sheen", "wool", "--loud", "-n", "3")
    assert (done.returncode, done.stdout) == (0, "wool True Fabric(weave='twill', threads=3)\n"), done.stderr
    done = _in_another_process(package, "--help")
    assert re.search(r"^Cloth:\n  sheen  +Print a fabric\.$", done.stdout, re.MULTILINE), done.stdout
    done = _in_another_process(package, "sheen", "--help")
    assert "gonio sheen wool --weave satin" in done.stdout and "-n N  " in done.stdout
    done = _in_another_process(package, "sheeen")
    assert done.returncode == 2 and "did you mean 'sheen'?" in done.stderr


def test_a_broken_package_costs_a_warning(package: Path) -> None:
    (package / "sheen_package.py").write_text("import no_such_thing")
    done = _in_another_process(package, "--version")
    assert done.returncode == 0 and "no_such_thing" not in done.stderr
    done = _in_another_process(package, "--help")
    assert done.returncode == 0 and "sheen_package:sheen is ignored: ModuleNotFoundError" in done.stderr


@pytest.mark.sample(2)
@pytest.mark.parametrize(
    ("line", "offered"),
    [
        ("gonio ren", "render"),
        ("gonio plot cond", "conductor"),
        ("gonio bake beck", "beckmann"),
        ("gonio plot conductor --preset A", "Ag Al Au"),
        ("gonio render --dev", "--device"),
    ],
)
def test_the_shell_completes_without_loading_drjit(tmp_path: Path, line: str, offered: str) -> None:
    words = {"COMP_WORDS": line, "COMP_CWORD": str(line.count(" ")), "PYTHONPROFILEIMPORTTIME": "1"}
    done = _in_another_process(tmp_path, _GONIO_COMPLETE="complete_bash", **words)
    assert done.stdout.split() == offered.split()
    assert "gonio.cli" in done.stderr and "drjit" not in done.stderr and "mitsuba" not in done.stderr


# --- errors --------------------------------------------------------------------------------------------


def test_no_arguments_print_the_help(capsys: pytest.CaptureFixture[str]) -> None:
    assert gonio() == 2
    told = capsys.readouterr()
    assert "Usage" in told.out + told.err and "error" not in told.err


def test_a_misspelt_verb_or_option_gets_a_hint(capsys: pytest.CaptureFixture[str]) -> None:
    assert "did you mean 'render'?" in failure(capsys, "rendr")
    assert "--spp" in failure(capsys, "render", "x", "--sp", 3)
    assert "gonio compare --help" in failure(capsys, "compare", "a.exr")


def test_a_missing_scene_is_named(scene: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = failure(capsys, "render", scene.with_name("bal"))
    assert "bal" in text and "did you mean 'ball'?" in text


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--spp", "0"], "0 samples"),
        (["--spp", "many"], "'--spp'"),
        (["--size", "0x10"], "no pixels"),
        (["--size", "10by10"], "is not a size"),
        (["--size", "900000x900000"], "GiB"),
        (["--integrator", "pathh"], "did you mean 'path'?"),
        (["--sampler", "sobl"], "did you mean 'sobol'?"),
        (["--device", "gpu"], "auto, cpu, cuda"),
        (["--threads", "0"], "threads"),
        (["--timeout", "-1"], "time limit"),
        (["-o", "nowhere/a.exr"], "does not exist"),
        (["-o", "a.jpeg"], "unknown picture format"),
    ],
)
def test_bad_options_are_one_clear_error(
    scene: Path, options: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert message in failure(capsys, "render", scene, *options)
    assert list(Path().iterdir()) == []


def test_an_error_in_the_scene_names_file_pointer_and_hint(scene: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = (scene / "scene.json").read_text().replace('"radius": 1', '"radius": -1')
    (scene / "scene.json").write_text(text)
    told = failure(capsys, "render", scene)
    assert "scene.json#/scene/shapes/0/radius" in told and " hint: " in told


def test_errors_can_be_json(scene: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert gonio("render", scene, "--spp", "0", "--json") == 2
    told = capsys.readouterr()
    error = json.loads(told.out)["error"]
    assert error["where"] == "--spp" and error["code"] == 2 and error["hint"]
    assert told.err == ""


def test_markup_in_a_message_is_printed_as_it_is(capsys: pytest.CaptureFixture[str]) -> None:
    assert "[bold]/x[/red]" in failure(capsys, "render", "[bold]/x[/red]")


def test_a_fault_of_our_own_says_how_to_report_it(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from gonio import scene as scenes

    monkeypatch.setattr(scenes, "json_schema", functools.partial(divmod, 1, 0))  # not code in a file of the user's
    monkeypatch.delenv("GONIO_DEBUG", raising=False)
    assert gonio("schema") == 3
    told = capsys.readouterr().err
    assert "ZeroDivisionError: " in told and "--debug" in told and "Traceback" not in told
    monkeypatch.setenv("GONIO_DEBUG", "1")
    with pytest.raises(ZeroDivisionError):
        cli.main(["schema"])


def test_a_full_disk_is_a_fault_of_the_machine(scene: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import errno

    def no_space(descriptor: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "fsync", no_space)
    assert gonio("render", scene) == 3
    (kept,) = Path().iterdir()  # in a folder of its own, which the error names
    assert kept.is_dir() and len(list(kept.iterdir())) == 1


# --- verbs ---------------------------------------------------------------------------------------------


def test_render_writes_beside_where_it_is_run_and_prints_the_path(
    scene: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert gonio("render", scene / "scene.json") == 0
    assert capsys.readouterr().out.startswith("ball.png  24x16, 4 spp")
    assert images.read("ball.png").metadata["spp"] == 4


def test_a_scenes_own_name_for_the_picture_counts_where_it_is_used(
    scene: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = (scene / "scene.json").read_text().replace("ball.png", "ball")
    (scene / "scene.json").write_text(text)
    told = failure(capsys, "render", scene)
    assert "is not a known kind of picture" in told and "scene.json#/output/filename" in told and "-o FILE" in told
    assert gonio("render", scene, "-o", "picture.exr", "--spp", 1) == 0
    assert gonio("study", scene, "--vary", "shapes.0.material.p=4", "--spp", 1) == 0


@pytest.mark.slow
def test_a_file_in_a_folder_is_a_material(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """`plot sub/mine.py:Own` said "no tables.npz here"."""
    (tmp_path / "sub").mkdir()
    body = "    def eval(self, wo, wi, mode='radiance'):\n        return self.tint * go.ops.maximum(wi.z, 0.0)\n"
    head = "import gonio as go\n\n\nclass Own(go.BSDF):\n    tint: go.Colour = go.spectrum(0.2, 'share')\n\n"
    (tmp_path / "sub" / "mine.py").write_text(head + body)
    monkeypatch.chdir(tmp_path)
    assert gonio("plot", "sub/mine.py:Own", "-o", "a.png") == 0
    assert gonio("plot", tmp_path / "sub" / "mine.py:Own", "--kind", "albedo") == 0
    assert Path("mine-own-albedo.png").is_file()


@pytest.mark.slow
def test_a_text_longer_than_a_files_name_may_be_is_a_material(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """It ended in "File name too long", as a fault of Gonio's."""
    monkeypatch.chdir(tmp_path)
    text = "lambert"
    while len(text) < 300:
        text = f"mix(a={text},b=conductor(preset=Au,alpha=.1))"
    assert gonio("plot", text, "-o", "a.png") == 0
    assert gonio("emit", text, "--functions", "eval", "-o", "a.glsl") == 0
    capsys.readouterr()
    assert "no file can have that name" in failure(capsys, "render", "y" * 300)


def test_parameters_go_to_a_material_alone(scene: Path, capsys: pytest.CaptureFixture[str]) -> None:
    told = failure(capsys, "study", scene, "-p", "p=3", "--vary", "shapes.0.material.p=4")
    assert "parameters of a material given" in told
    assert gonio("study", "phong", "-p", "kd=.2", "--vary", "p=4,16", "--spp", 1, "--size", "8x8") == 0


def test_render_reports_json(scene: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert gonio("render", scene, "-o", "a.exr", "--spp", "2", "--size", "8x4", "--json") == 0
    result = json.loads(capsys.readouterr().out)
    assert result["output"] == "a.exr" and result["size"] == [8, 4] and result["spp"] == 2
    assert result["stopped"] == "" and result["settings"]["integrator"] == "directSampleLight"


def test_exposure_brightens_a_png(scene: Path) -> None:
    assert gonio("render", scene, "-o", "a.png", "--exposure", "-2") == 0
    assert gonio("render", scene, "-o", "b.png", "--exposure", "-3") == 0
    dim, dimmer = images.read("a.png").pixels, images.read("b.png").pixels
    assert dim.mean() == pytest.approx(2 * dimmer.mean(), rel=0.02)


def test_an_exposure_is_chosen_by_the_picture(scene: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert gonio("render", scene, "-o", "a.exr") == 0
    capsys.readouterr()
    assert gonio("render", scene, "-o", "a.png", "--exposure", "auto") == 0
    told = capsys.readouterr()
    chosen = images.read("a.png").metadata["exposure"]
    assert f"exposure {chosen:+g} EV" in told.out and told.err == ""
    assert gonio("convert", "a.exr", "-o", "b.png", "--exposure", "auto", "--json") == 0
    assert json.loads(capsys.readouterr().out) == {"output": "b.png", "exposure": chosen, "notice": ""}
    np.testing.assert_array_equal(images.read("a.png").pixels, images.read("b.png").pixels)
    vary = ["--vary", "scene.shapes.0.material.p=8", "--exposure", "auto", "--json"]
    assert gonio("study", scene, *vary) == 0
    assert json.loads(capsys.readouterr().out)["exposure"] == chosen


def test_what_clips_is_told(scene: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert gonio("render", scene, "-o", "a.exr", "--exposure", "1") == 0
    assert ".exr stores radiance" in capsys.readouterr().err
    for arguments in (["render", scene, "-o", "a.png"], ["convert", "a.exr", "-o", "a.png"]):
        assert gonio(*arguments, "--exposure", "9") == 0
        told = re.search(
            r"warning: (\d+)% of the pixels .* try --exposure (-?[\d.]+), or auto", capsys.readouterr().err
        )
        assert told and int(told[1]) > 1
        assert gonio(*arguments, "--exposure", told[2]) == 0
        assert capsys.readouterr().err == ""
    assert gonio("study", scene, "--vary", "scene.shapes.0.material.p=8", "--exposure", "9") == 0
    assert "are brighter than white" in capsys.readouterr().err


def test_plot_and_view_report_json(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert gonio("plot", "lambert", "--kind", "albedo", "-o", tmp_path / "a.png", "--json") == 0
    assert json.loads(capsys.readouterr().out) == {"output": str(tmp_path / "a.png"), "about": "albedo: lambert"}
    assert gonio("view", "conductor", "--preset", "Au", "-o", tmp_path / "a.html", "--json") == 0
    told = json.loads(capsys.readouterr().out)
    assert told == {"output": str(tmp_path / "a.html"), "size": (tmp_path / "a.html").stat().st_size}


def test_verify_takes_presets(capsys: pytest.CaptureFixture[str]) -> None:
    pairs = []
    for words in (["conductor", "--preset", "Cu"], ["conductor(preset=Cu)"], ["conductor"]):
        assert gonio("verify", *words, "--at", "30,0/40,180", "--json") == 0
        pairs.append(json.loads(capsys.readouterr().out))
    values = [pair["rows"] if "rows" in pair else {k: v for k, v in pair.items() if k != "target"} for pair in pairs]
    assert str(values[0]) == str(values[1]) != str(values[2])


def test_fits_take_presets_of_single_models() -> None:
    from gonio.cli.options import Fitting

    assert Fitting(preset="Au").models(["conductor(alpha=.2)"]) == ["conductor(alpha=.2,preset=Au)"]
    with pytest.raises(go.InputError, match="is a sum of materials"):
        Fitting(preset="Au").models(["lambert+conductor"])
    with pytest.raises(go.InputError, match="without a model"):
        Fitting(preset="Au").models([])


def test_convert_keeps_the_picture_and_its_settings(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    pixels = np.random.default_rng(1).random((5, 7, 3), np.float32)
    images.write("a.exr", pixels, {"spp": 4})
    for source, output, tolerance in (("a.exr", "a.npz", 0.0), ("a.npz", "a.hdr", 0.005), ("a.exr", "a.png", 0.02)):
        assert gonio("convert", source, "-o", output) == 0
        assert capsys.readouterr().out.startswith(output)
        got = images.read(output)
        np.testing.assert_allclose(got.pixels, pixels, atol=tolerance)
        assert got.metadata["spp"] == 4
    assert gonio("convert", "a.png", "-o", "a.png", "--exposure", "-1") == 0
    np.testing.assert_allclose(images.read("a.png").pixels, pixels / 2, atol=0.02)
    capsys.readouterr()
    before = Path("a.png").read_bytes()
    assert "unknown picture format '.jpg'" in failure(capsys, "convert", "a.exr", "-o", "a.jpg")
    assert "cannot read" in failure(capsys, "convert", "b.exr", "-o", "a.png")
    assert "not an exposure" in failure(capsys, "convert", "a.exr", "-o", "a.png", "--exposure", "bright")
    assert "-100 to 100" in failure(capsys, "convert", "a.exr", "-o", "a.png", "--exposure", "nan")
    assert Path("a.png").read_bytes() == before


def test_settings_are_shared_by_the_materials_that_have_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from gonio.cli.options import Material

    made = Material(param=["alpha=.3"], preset="Au")
    assert made.texts(["conductor", "lambert", "dielectric(eta=1.3,alpha=.1)"]) == [
        "conductor(preset=Au,alpha=.3)",
        "lambert",
        "dielectric(preset=Au,alpha=.1,eta=1.3)",
    ]
    assert made.texts(["conductor(eta=.2,.9,1.1)"]) == ["conductor(eta=.2,.9,1.1,preset=Au,alpha=.3)"]
    monkeypatch.chdir(tmp_path)
    assert gonio("plot", "lambert", "conductor", "-p", "alpha=.3", "--kind", "albedo", "--angles", "30") == 0
    assert (
        capsys.readouterr().out == "lambert-conductor-albedo.png\n" and Path("lambert-conductor-albedo.png").is_file()
    )
    assert "did you mean 'alpha'" in failure(capsys, "plot", "lambert", "conductor", "-p", "alfa=.3")
    assert "give ward.py:CLASS" in failure(capsys, "plot", "ward.py")


def test_plots_of_classes_of_one_name_get_files_of_their_own() -> None:
    from gonio.cli.verbs.plot import _file_name

    heads = ("conductor", "ward.py:Ward", "mine/velvet.py:Ward", "gloss.py:Ward")
    assert [*map(_file_name, heads)] == ["conductor", "ward", "velvet-ward", "gloss-ward"]


@pytest.mark.slow
def test_a_new_material_works(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert gonio("new", "material", "crushed-velvet") == 0
    assert capsys.readouterr().out.split() == ["crushed_velvet.py", "test_crushed_velvet.py"]
    assert gonio("verify", "crushed_velvet.py:CrushedVelvet", "--quick", "--law", "weight", "--law", "energy") == 0
    capsys.readouterr()
    assert gonio("explain", "crushed_velvet.py:CrushedVelvet") == 0
    assert f"Source: {tmp_path.resolve() / 'crushed_velvet.py'}" in capsys.readouterr().out
    before = (tmp_path / "crushed_velvet.py").read_text()
    assert "already exists" in failure(capsys, "new", "material", "CrushedVelvet")
    assert (tmp_path / "crushed_velvet.py").read_text() == before


@pytest.mark.slow
def test_the_test_of_a_new_material_passes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert gonio("new", "material", "crushed-velvet") == 0
    done = subprocess.run([sys.executable, "-m", "pytest", "-q"], capture_output=True, text=True)
    assert done.returncode == 0 and "2 passed" in done.stdout, done.stdout + done.stderr


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["materal", "velvet"], "did you mean 'material'?"),
        (["material", "lambert"], "Gonio has a material 'lambert'"),
        (["material", "3"], "cannot name a Python file"),
        (["material", "../velvet"], "cannot name a Python file"),
        (["material", "import"], "cannot name a Python file"),
        (["material", "velvet", "-o", "no/folder"], "does not exist"),
    ],
)
def test_what_cannot_be_begun_is_one_clear_error(
    words: list[str], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert message in failure(capsys, "new", *words)
    assert list(tmp_path.iterdir()) == []


def test_study_lays_out_every_combination(scene: Path, capsys: pytest.CaptureFixture[str]) -> None:
    vary = ["--vary", "scene.shapes.0.material.p=4,16", "--vary", "scene.shapes.0.material.kd=[.1,.1,.1],[0.5,0,0],.9"]
    assert gonio("study", scene, *vary, "-o", "sheet.png", "--json") == 0
    result = json.loads(capsys.readouterr().out)
    assert len(result["cells"]) == 6
    assert result["cells"][1] == {"scene.shapes.0.material.p": 4, "scene.shapes.0.material.kd": [0.5, 0, 0]}
    assert Path("sheet.png").stat().st_size > 1000


def test_study_refuses_a_path_that_leads_nowhere(scene: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert "'radius'" in failure(capsys, "study", scene, "--vary", "scene.shapes.0.radios=1,2")
    assert "NAME=VALUE expected" in failure(capsys, "study", scene, "--vary", "radius")
    assert "figure format" in failure(capsys, "study", scene, "--vary", "a=1", "-o", "a.exr")


@pytest.fixture
def two_pictures(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    reference = np.full((12, 16, 3), 0.5, np.float32)
    images.write("a.exr", reference * 1.1)
    images.write("b.exr", reference)
    images.write("small.npz", reference[:4])


@pytest.mark.usefixtures("two_pictures")
def test_compare_judges_by_the_tolerance(capsys: pytest.CaptureFixture[str]) -> None:
    assert gonio("compare", "a.exr", "b.exr", "--json") == 0
    result = json.loads(capsys.readouterr().out)
    assert result["rmse"] == pytest.approx(0.05) and result["mean_ratio"] == pytest.approx(1.1)
    assert gonio("compare", "a.exr", "b.exr", "--metric", "rmse", "--tolerance", "0.06") == 0
    assert gonio("compare", "a.exr", "b.exr", "--metric", "rmse", "--tolerance", "0.04", "-o", "map.png") == 1
    assert "fails       rmse 0.05 > 0.04" in capsys.readouterr().out
    assert Path("map.png").is_file()


@pytest.mark.usefixtures("two_pictures")
def test_compare_refuses_what_cannot_be_compared(capsys: pytest.CaptureFixture[str]) -> None:
    assert "differ in size: 16x12 and 16x4" in failure(capsys, "compare", "a.exr", "small.npz")
    assert "cannot read" in failure(capsys, "compare", "a.exr", "c.exr")
    assert "did you mean 'relmse'?" in failure(capsys, "compare", "a.exr", "b.exr", "--metric", "relms")
    assert "tolerance" in failure(capsys, "compare", "a.exr", "b.exr", "--tolerance", "nan")


def test_models_and_explain_know_every_material(capsys: pytest.CaptureFixture[str]) -> None:
    from gonio.material import models

    assert gonio("models", "--json") == 0
    assert list(json.loads(capsys.readouterr().out)) == list(models())
    for name, cls in models().items():
        assert gonio("explain", name, "--json") == 0
        page = json.loads(capsys.readouterr().out)
        assert [row["name"] for row in page["parameters"]] == list(cls.parameters())
        assert page["doc"]
    assert gonio("explain", "conductor") == 0
    text = capsys.readouterr().out
    assert "alpha" in text and "Mitsuba plugin: gonio_conductor" in text
    assert "Source: src/gonio/materials/microfacet/conductor.py" in text
    assert "alpha, >= 0 and <= 1, default 0.1" in text
    assert gonio("explain", "coat") == 0
    assert "bsdf, required" in " ".join(capsys.readouterr().out.split())
    assert gonio("explain", "phong") == 0
    assert "By design, this model violates the reciprocity law: " in capsys.readouterr().out
    assert "did you mean 'lambert'?" in failure(capsys, "explain", "lamberd")


@pytest.mark.slow
def test_schema_is_a_json_schema(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert gonio("schema") == 0
    printed = json.loads(capsys.readouterr().out)
    assert "$schema" in printed
    assert gonio("schema", "-o", tmp_path / "s.json") == 0
    assert json.loads((tmp_path / "s.json").read_text()) == printed


# --- doctor --------------------------------------------------------------------------------------------


def _doctor(**environment: str) -> tuple[int, dict[str, object]]:
    done = subprocess.run(
        [sys.executable, "-m", "gonio.cli", "doctor", "--json"],
        capture_output=True,
        text=True,
        env={**os.environ, **environment},
    )
    return done.returncode, json.loads(done.stdout)


def test_the_doctor_finds_something_to_render_with() -> None:
    code, report = _doctor()
    assert code == 0 and report["can_render"] is True
    subjects = [finding["subject"] for finding in report["findings"]]  # type: ignore[attr-defined]
    assert {"Mitsuba", "Dr.Jit", "threads", "denoiser", "shader compiler", "render on cpu"} <= set(subjects)


def test_the_doctor_prints_brackets(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    from gonio.render import doctor

    finding = doctor.Finding("missing", "denoiser", "pip install 'gonio[denoise]' :smile:")
    monkeypatch.setattr(doctor, "examine", lambda: doctor.Report((finding,), {"cpu": ""}))
    assert gonio("doctor") == 0
    assert "pip install 'gonio[denoise]' :smile:" in capsys.readouterr().out


@pytest.mark.slow
def test_the_doctor_survives_a_library_that_is_none(tmp_path: Path) -> None:
    wrong = tmp_path / "libLLVM.so"
    wrong.write_bytes(b"no library")
    usable = [library for library in llvm.libraries() if library.usable]
    code, report = _doctor(DRJIT_LIBLLVM_PATH=str(wrong), CUDA_VISIBLE_DEVICES="")
    assert (code, report["can_render"]) == ((0, True) if usable else (3, False))
    used = [finding["text"] for finding in report["findings"] if finding["state"] == "ok"]  # type: ignore[attr-defined]
    assert not any(str(wrong) in text for text in used)


def test_several_errors_of_a_scene_are_told_apart(scene: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = json.loads((scene / "scene.json").read_text())
    text["integrator"]["type"] = "pathTracer"
    text["camera"]["verticalFov"] = "wide"
    (scene / "scene.json").write_text(json.dumps(text))
    assert gonio("render", scene) == 2
    assert "; also " in capsys.readouterr().err


def test_emit_names_the_tables_that_only_a_folder_receives(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    material = "kulla-conty(base=conductor)"
    assert gonio("emit", material, "--functions", "eval", "-o", "a.glsl") == 0
    names = "table_missing_ggx_smith_correlated"
    said = f"the shader reads a table that is not in its text: {names}; -o DIR/ writes them too\n"
    assert capsys.readouterr().err == said
    assert "missing_ggx_smith_correlated.f32, which an output folder (-o DIR/) contains" in Path("a.glsl").read_text()
    assert gonio("emit", material, "--functions", "eval", "-o", "a/") == 0
    assert not capsys.readouterr().err and Path("a/missing_ggx_smith_correlated.f32").is_file()
