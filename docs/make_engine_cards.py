"""Write docs/report-cards/engines/: the verdicts on engines' shaders, from packages that the user provides.

    python docs/make_engine_cards.py PACKAGES [--only three,...]     measure, store cards.json, write pages and pictures
    python docs/make_engine_cards.py [--check]                       write pages from cards.json, or compare them
    python docs/make_engine_cards.py --pictures                      draw the pictures, too
    python docs/make_engine_cards.py PACKAGES --programs             run programs/*.html; store their output

PACKAGES is a folder with one folder per release, each with its package.json, such as three-0.185.1 and three-0.187.0:

    npm pack three@0.187.0 && mkdir three-0.187.0 && tar xzf three-0.187.0.tgz -C three-0.187.0 --strip-components=1

For an engine that is not on npm, the folder is named PAGE-VERSION: bevy-0.19.0 is a checkout, and materialx-1.39.5
contains the shaders written by programs/materialx_generate.py.

docs/engine_cases declares the measurements for each engine and the causes of its failures.
"""

from __future__ import annotations

import argparse
import json
import re
import shutil
import sys
import tempfile
import textwrap
from pathlib import Path
from typing import Any

import gonio as go
import matplotlib
from engine_cases import engines
from engine_cases.base import COSINES, ROUGHNESSES, Engine, furnace, material, shader
from gonio.catalog import shaders
from gonio.verify.severity import percent
from gonio.verify.verdict import Verdict
from PIL import Image

matplotlib.use("agg")
import matplotlib.pyplot as plt

FOLDER = Path(__file__).parent / "report-cards" / "engines"
STORED = FOLDER / "cards.json"
SEED = 1
OVERVIEW = """These cards report how the shaders of rendering engines perform in
[`gonio verify`](../../verify.md) and in white-furnace tests. Gonio contains no source code from the engines: given a
package or a checkout, `gonio adopt` writes a program that includes the engine's own files
([how this works](../../shaders.md#engines)). Each card states the size of every failure, the function or table that
causes it, and the commands that reproduce it. Several cards also link to a program that reproduces white-furnace
results without Gonio. The tests check laws that a path tracer relies on. A rasterizer need not be reciprocal, and
several causes are deliberate design choices. Corrections are welcome. There is no card for Filament, because its npm
package contains only compiled materials, without their source code.
"""


# --------------------------------------------------------------------------- measuring


def releases(packages: Path, only: set[str]) -> dict[str, list[shaders.Package]]:
    """Packages in a folder, keyed by name, with their releases in order."""
    found: dict[str, list[shaders.Package]] = {}
    for one in sorted([*packages.glob("*/package.json"), *packages.glob("@*/*/package.json")]):
        try:
            package = shaders.package_in(one.parent)
        except go.InputError:
            continue
        if not only or package.name in only:
            found.setdefault(package.name, []).append(package)
    for engine in engines().values():
        if engine.origin != "npm" and (not only or engine.package in only):
            for folder in packages.glob(f"{engine.page}-*/"):
                version = folder.name.removeprefix(f"{engine.page}-")
                found.setdefault(engine.package, []).append(shaders.Package(engine.package, version, folder))
    return {name: sorted(every, key=lambda one: _order(one.version)) for name, every in found.items()}


def _order(version: str) -> list[int]:
    return [int(part) for part in re.findall(r"\d+", version)]


def measured(engine: Engine, package: shaders.Package) -> dict[str, Any]:
    """Everything that is measured for one release."""
    with tempfile.TemporaryDirectory(prefix="gonio-engine-") as place:
        folder = Path(place)
        if engine.made:
            shutil.copytree(package.folder, folder, dirs_exist_ok=True)
        else:
            shaders.adopt_package(package.folder, folder, tsl=engine.tsl)
        return {
            "furnaces": {
                one.title: [furnace(material(folder, one.material, **one.parameters(r))) for r in ROUGHNESSES]
                for one in engine.furnaces
            },
            "trials": engine.trials(folder),
            "laws": {name: _judged(folder, name, engine.laws) for name in engine.materials},
        }


def _judged(folder: Path, name: str, laws: tuple[str, ...]) -> dict[str, Any]:
    stem, _, settings = name.partition("(")  # "three-standard(metal=0)"
    (card,) = go.verify(
        f"{shader(folder, stem)}{'(' * bool(settings)}{settings}", quick=True, seed=SEED, law=laws or None
    ).cards
    return {
        v.law: {
            "status": v.status,
            "grade": str(v.grade or ""),
            "shown": v.shown,
            "size": _size(v) if v.failed else "",
            "at": ", ".join(f"{key} {value}" for key, value in _settings(v.why)) if v.failed else "",
        }
        for v in card.verdicts
    }


def _settings(why: list[str]) -> list[tuple[str, str]]:
    """Parameter values stated in the text of a verdict, such as "at rough = 0, metal = 0: ..."."""
    match = re.match(r"at ((?:\w+ = [\d.e+-]+(?:, )?)+):", why[0]) if why else None
    return re.findall(r"(\w+) = ([\d.e+-]+)", match[1]) if match else []


def _size(v: Verdict) -> str:
    if v.bias is not None and v.bias.kind in ("bias", "lost", "gained"):
        verb = {"bias": "wrong by", "lost": "loses", "gained": "gains"}[v.bias.kind]
        return f"{verb} {percent(v.bias.average)} of the reflected light on average, {percent(v.bias.worst)} at worst"
    return v.shown if v.bias is None else v.bias.words


def run_programs(packages: list[shaders.Package]) -> None:
    """Run the programs that do not use Gonio, and store their output for each release."""
    from engine_programs import PROGRAMS, printed

    for package in packages:
        for program in engines()[package.name].programs:
            path = PROGRAMS / f"{Path(program).stem}-{package.version}.txt"
            path.write_text(printed(package, program), encoding="utf-8")
            print(path.name, flush=True)


# --------------------------------------------------------------------------- pages


def cause(engine: Engine, name: str, law: str, version: str, figures: dict[str, float]) -> str:
    """Cause of a failure, with measured values of the trials filled in, or "unknown"."""
    text = engine.causes.get((name, law, version)) or engine.causes.get((name, law))
    return text.format_map(figures) if text else "unknown."


def page(engine: Engine, results: dict[str, Any]) -> str:
    """Report card of an engine, from stored values only."""
    versions = list(results)
    last = results[versions[-1]]
    shown = " and ".join(versions)
    source = engine.source.format(version=shown) or f"`{engine.package}` {shown} from {engine.origin}"
    lines = [
        f"# {engine.title}",
        "",
        f"Tested: {source}. Source code: [repository]({engine.home}).",
        "This page is generated by `python docs/make_engine_cards.py`; [cards.json](cards.json) contains all measured "
        "values.",
        "",
        engine.intro,
        "",
        "## White furnace",
        "",
        "The tables give the albedo of white materials (all color factors set to 1) for five values of roughness and",
        "six of n.v, the cosine of the view angle. The ideal albedo is 1: a lower value is a loss of energy, a higher",
        "value a gain.",
        "",
        f"![White furnaces of {engine.title}]({engine.page}.png)",
    ]
    for one in engine.furnaces:
        lines += ["", f"### {one.label}", "", *_furnace_table(one.title, results)]
        if remark := engine.remarks.get(one.title):
            lines += ["", _wrapped(remark.format_map(last["trials"]))]
    lines += (
        ["", engine.sections({version: results[version]["trials"] for version in versions})] if engine.sections else []
    )
    lines += ["", "## Failures", "", *_failures(engine, results), "", *_again(engine, versions[-1])]
    return "\n".join(lines).replace("\n\n\n", "\n\n") + "\n"


def _furnace_table(title: str, results: dict[str, Any]) -> list[str]:
    lines = [
        f"| roughness | {' | '.join(f'n.v {cosine:g}' for cosine in COSINES)} |",
        "|---" * (len(COSINES) + 1) + "|",
    ]
    for place, roughness in enumerate(ROUGHNESSES):
        cells = [
            " → ".join(f"{result['furnaces'][title][place][column]:.3f}" for result in results.values())
            for column in range(len(COSINES))
        ]
        lines.append(f"| {roughness:g} | {' | '.join(cells)} |")
    return lines


def _failures(engine: Engine, results: dict[str, Any]) -> list[str]:
    laws = list(next(iter(next(iter(results.values()))["laws"].values())))
    only = f" Only {', '.join(laws[:-1])} and {laws[-1]} were tested." if engine.laws else ""
    lines = [
        _wrapped(
            f"The table gives the verdicts of `gonio verify --quick` with seed {SEED}, at the default parameter values "
            f"and over the full parameter ranges.{only} A failure is shown by its "
            "[grade](../../verify.md#severity-of-a-failure); a hyphen means that the law does not apply. For each "
            "failure, the list below the table gives the measured value, the effect, the parameter values if they "
            "differ from the defaults, and the cause. Directions are given as theta, phi in degrees."
        ),
        "",
        f"| material | release | {' | '.join(laws)} |",
        "|---" * (len(laws) + 2) + "|",
    ]
    for name in engine.materials:
        for version, result in results.items():
            cells = [_cell(result["laws"][name][law]) for law in laws]
            lines.append(f"| {name} | {version} | {' | '.join(cells)} |")
    for name in engine.materials:
        lines += ["", f"### {name}", ""]
        count = len(lines)
        for law in laws:
            for version, result in results.items():
                one = result["laws"][name][law]
                if one["status"] == "fail":
                    at = f" ({one['at']})" if one["at"] else ""
                    why = cause(engine, name, law, version, result["trials"])
                    words = f"- **{law}**, {version}: {one['shown']}. Effect: {one['size']}{at}. Cause: {why}"
                    lines.append(_wrapped(words, "  "))
        lines += ["All laws hold."] if len(lines) == count else []
    return lines


def _cell(one: dict[str, str]) -> str:
    if one["status"] != "fail":
        return {"does not apply": "-", "breaks as declared": "declared"}.get(one["status"], one["status"])
    return f"**fail** ({one['grade']})" if one["grade"] else "**fail**"


def _again(engine: Engine, version: str) -> list[str]:
    stem = engine.page
    get = engine.again.format(version=version) or (
        f"npm install {engine.package}@{version}\n"
        f"gonio adopt node_modules/{engine.package} -o {stem}{' --tsl' * engine.tsl}"
    )
    lines = ["## Reproducing these results", "", *(f"    {line}" for line in get.split("\n"))]
    for name in engine.materials:
        suffix = ".wgsl" if engine.tsl and "-tsl-" in name else f".{engine.language}"
        lines.append(f"    gonio verify {_operand(stem, name, suffix)}")
    if engine.programs:
        links = ", ".join(f"[{name}](programs/{name})" for name in engine.programs)
        printed = sorted((FOLDER / "programs").glob(f"{stem}-*.txt"))
        outputs = ", ".join(f"[{one.stem}](programs/{one.name})" for one in printed)
        lines += [
            "",
            f"{links} reproduces white-furnace results without Gonio; the file begins with instructions.",
        ]
        lines += [f"Its output is stored in {outputs}."]
    return lines


def _operand(folder: str, name: str, suffix: str) -> str:
    stem, _, settings = name.partition("(")
    return f'"{folder}/{stem}{suffix}({settings}"' if settings else f"{folder}/{stem}{suffix}"


def _wrapped(text: str, indent: str = "") -> str:
    return textwrap.fill(text, 120, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False)


def overview(stored: dict[str, Any]) -> str:
    """The overview page, with one row per engine."""
    lines = [
        "# Engine report cards",
        "",
        *OVERVIEW.split("\n"),
        "| engine | release | albedo of white metal at roughness 1 and n.v 1 | largest energy gain (albedo - 1) "
        "| violated laws |",
        "|---|---|---|---|---|",
    ]
    for name, results in stored.items():
        engine, last = engines()[name], list(results.values())[-1]
        metal = last["furnaces"][engine.furnaces[0].title][-1][-1]
        gain, title = max((max(map(max, last["furnaces"][one.title])) - 1.0, one.label) for one in engine.furnaces)
        failed = sorted({law for laws in last["laws"].values() for law, one in laws.items() if one["status"] == "fail"})
        lines.append(
            f"| [{engine.title}]({engine.page}.md) | {', '.join(results)} | {metal:.3f} | "
            f"{max(gain, 0.0):.3f} ({title[:1].lower()}{title[1:]}) | {', '.join(failed) or 'none'} |"
        )
    lines += [
        "",
        "n.v is the cosine of the view angle. The energy gain is the largest in any furnace of the newest release.",
        "",
        "The BRDF Explorer is not a rendering engine; its models have [their own card](brdf-explorer.md).",
    ]
    return "\n".join(lines) + "\n"


# --------------------------------------------------------------------------- pictures


def picture(engine: Engine, results: dict[str, Any], path: Path) -> None:
    """Draw all white furnaces of an engine, one row per furnace and one column per release.

    Blue cells lose energy, red cells gain it.
    """
    columns, rows = len(results), len(engine.furnaces)
    figure, axes = plt.subplots(rows, columns, figsize=(5.2 * columns + 0.8, 3.2 * rows + 0.4), squeeze=False,
                                constrained_layout=True)  # fmt: skip
    image = None
    for across, (version, result) in enumerate(results.items()):
        for down, one in enumerate(engine.furnaces):
            axis, values = axes[down][across], result["furnaces"][one.title]
            image = axis.imshow(values, cmap="RdBu_r", vmin=0.5, vmax=1.5, aspect="auto", origin="lower")
            for y, row in enumerate(values):
                for x, value in enumerate(row):
                    dark = abs(value - 1.0) > 0.32
                    axis.text(x, y, f"{value:.2f}", ha="center", va="center", fontsize=14, color="w" if dark else "k")
            axis.set_xticks(range(len(COSINES)), [f"{cosine:g}" for cosine in COSINES], fontsize=13)
            axis.set_yticks(range(len(ROUGHNESSES)), [f"{roughness:g}" for roughness in ROUGHNESSES], fontsize=13)
            heading = "\n".join(textwrap.fill(part, 44) for part in one.label.replace("; ", ";\n").split("\n"))
            axis.set_title(f"{heading}\n{engine.title} {version}", fontsize=14)
            axis.set_xlabel("n.v", fontsize=14)
            axis.set_ylabel("roughness", fontsize=14)
            axis.tick_params(length=0)
            for side in axis.spines.values():
                side.set_visible(False)
    bar = figure.colorbar(image, ax=axes, shrink=0.6, aspect=40, pad=0.015, extend="both")
    bar.set_label("albedo (ideal: 1)", fontsize=14)
    bar.ax.tick_params(labelsize=13)
    figure.savefig(path, dpi=114, metadata={"Software": None})
    plt.close(figure)
    with Image.open(path) as drawn:
        drawn.convert("RGB").quantize(256).save(path, optimize=True)  # a third of the size


def written(stored: dict[str, Any]) -> dict[Path, str]:
    """All pages, keyed by path."""
    pages = {FOLDER / f"{engines()[name].page}.md": page(engines()[name], one) for name, one in stored.items()}
    return {FOLDER / "README.md": overview(stored), **pages}


def main() -> int:
    """Measure if packages are given, write or check the pages, and return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("packages", nargs="?", type=Path)
    parser.add_argument("--only", default="")
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--programs", action="store_true", help="run the programs that do not use Gonio, in Chromium")
    parser.add_argument("--pictures", action="store_true", help="redraw the pictures from the stored values")
    options = parser.parse_args()
    stored: dict[str, Any] = json.loads(STORED.read_text(encoding="utf-8")) if STORED.is_file() else {}
    only = set(filter(None, options.only.split(",")))
    if options.programs:
        for packages in releases(options.packages, only).values():
            run_programs(packages)
        return 0
    if options.packages is not None:
        for name, packages in releases(options.packages, only).items():
            stored[name] = {one.version: measured(engines()[name], one) for one in packages}
            picture(engines()[name], stored[name], FOLDER / f"{engines()[name].page}.png")
            print(f"{name}: {', '.join(stored[name])}", flush=True)
        stored = dict(sorted(stored.items()))
        STORED.write_text(json.dumps(stored, indent=1) + "\n", encoding="utf-8")
    stale = [path for path, text in written(stored).items() if not path.is_file() or path.read_text() != text]
    if options.check:
        print("\n".join(f"out of date: {path}" for path in stale) or "all pages are up to date")
        return int(bool(stale))
    if options.pictures:
        for name, results in stored.items():
            picture(engines()[name], results, FOLDER / f"{engines()[name].page}.png")
    for path, text in written(stored).items():
        path.write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
