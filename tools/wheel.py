"""Build a wheel and a source archive, and try each in an empty environment outside the repository: `make wheel`.

    python tools/wheel.py            # writes dist/: the wheel, the archive, and a bill of materials of the tried wheel

Each environment is created in a temporary folder, so that neither the repository nor packages installed here can supply
a file that the package lacks.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import venv
from collections.abc import Sequence
from pathlib import Path

ROOT = Path(__file__).parents[1]
DIST = ROOT / "dist"
# Verbs that read files which the package must contain: models, tables, indices, templates, the page, schemas, a sample.
TRIED = (
    "models",
    "explain ggx",
    "schema scene -o scene.schema.json",
    "new material velvet",
    "emit conductor -o conductor.glsl",
    "render conductor --preset Au --spp 2 --size 16x16 -o gold.exr",
    "render alum-bronze --spp 2 --size 16x16 -o bronze.png",
    "convert gold.exr -o gold.png",
    "view lambert --export page.html",
    "verify lambert --quick",
)


def run(command: Sequence[str | Path], folder: Path) -> None:
    """Run a command; if it fails, exit with its output."""
    environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    done = subprocess.run(
        [*map(str, command)], cwd=folder, env=environment, capture_output=True, text=True, check=False
    )
    if done.returncode:
        sys.exit(f"{' '.join(map(str, command))}: exit code {done.returncode}\n{done.stdout}{done.stderr}")


def environment(folder: Path, *packages: str | Path) -> Path:
    """Create an environment with these packages; returns its folder of programs."""
    venv.create(folder, with_pip=True)
    programs = folder / ("Scripts" if os.name == "nt" else "bin")
    run([programs / "python", "-m", "pip", "install", "--quiet", "--disable-pip-version-check", *packages], folder)
    return programs


def build(folder: Path) -> list[Path]:
    """The wheel and the source archive, in dist."""
    DIST.mkdir(exist_ok=True)
    for old in DIST.glob("gonio-*"):
        old.unlink()
    python = environment(folder / "build", "build") / "python"
    run([python, "-m", "build", "--outdir", DIST, ROOT], folder)
    return sorted(DIST.glob("gonio-*.whl")) + sorted(DIST.glob("gonio-*.tar.gz"))


def tried(artifact: Path, folder: Path) -> Path:
    """Install it into an empty environment and run verbs there; returns its folder of programs."""
    programs = environment(folder / "environment", artifact)
    work = folder / "work"
    work.mkdir()
    run([programs / "python", "-c", "import gonio; assert 'environment' in gonio.__file__, gonio.__file__"], work)
    for command in TRIED:
        run([programs / "gonio", *command.split()], work)
    return programs


def main() -> None:
    with tempfile.TemporaryDirectory() as temporary:
        artifacts = build(Path(temporary))
        assert len(artifacts) == 2, artifacts
        for number, artifact in enumerate(artifacts):
            folder = Path(temporary) / str(number)
            folder.mkdir()
            programs = tried(artifact, folder)
            if artifact.suffix == ".whl":
                run([programs / "python", ROOT / "tools" / "bill.py", DIST / "gonio.cdx.json"], folder)
            print(f"{artifact.relative_to(ROOT)}  {artifact.stat().st_size / 1e6:.1f} MB, {len(TRIED)} verbs tried")
    print("dist/gonio.cdx.json")


if __name__ == "__main__":
    main()
