"""Kill jobs at random times, damage what they have kept, let them go on, and compare with a job that nobody disturbed.

python tests/killing.py --runs 50        # prints a line a run, and ends with 1 where a bit differs
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

SCENE = {
    "output": {"filename": "ball.exr"},
    "sampler": {"type": "independent", "xSamples": 2, "ySamples": 2},
    "camera": {
        "type": "pinhole",
        "transform": {"position": [0, 1, 4], "lookAt": [0, 0, 0], "up": [0, 1, 0]},
        "verticalFov": 40,
        "film": {"size": [96, 64]},
    },
    "integrator": {"type": "path", "maxDepth": 5},
    "scene": {
        "shapes": [
            {
                "type": "sphere",
                "center": [0, 0, 0],
                "radius": 1,
                "material": {"type": "matte", "albedo": [0.7, 0.5, 0.3]},
            },
            {
                "type": "sphere",
                "center": [1.4, 0.2, 0.5],
                "radius": 0.5,
                "material": {"type": "matte", "albedo": [0.5, 0.5, 0.5]},
            },
        ],
        "lights": [
            {"type": "spotLight", "position": [2, 3, 4], "energy": [40, 40, 40]},
            {"type": "environmentLight", "radiance": [0.3, 0.4, 0.5]},
        ],
    },
}

# The command itself, with a checkpoint every tenth of a second instead of every three: jobs can then be short.
PROGRAM = """
import sys
from gonio.render import checkpoints
checkpoints.INTERVAL, checkpoints.MAX_COST = .1, 1e9
from gonio import cli
cli.main(sys.argv[1:])
"""

KINDS = {
    "direct": ["render", "{scene}", "-o", "{out}.exr", "--integrator", "direct", "--spp", "{spp}", "--checkpoint", "c"],
    "path": ["render", "{scene}", "-o", "{out}.exr", "--spp", "{spp}", "--checkpoint", "c"],
    "denoised": ["render", "{scene}", "-o", "{out}.exr", "--spp", "{spp}", "--denoise", "--checkpoint", "c"],
    "study": [
        "study",
        "{scene}",
        "-o",
        "{out}.png",
        "--spp",
        "{few}",
        "--vary",
        "shapes.*.material.albedo=.2,.4,.6,.8",
    ],
    "bake": ["bake", "ggx", "-o", "{out}", "--resolution", "{size}"],
}


def command(kind: str, scene: Path, out: str, length: float) -> list[str]:
    """Of about `length` seconds on two cores."""
    spp = int(4000 * length)
    values = {"scene": scene, "out": out, "spp": spp, "few": spp // 5, "size": int(90 * length**0.5)}
    return [sys.executable, "-c", PROGRAM, *(part.format(**values) for part in KINDS[kind])]


def content(folder: Path, out: str) -> str:
    """The hash of what a job has written: pixels and tables, not the time that stands beside them."""
    from gonio.pictures import images

    found = hashlib.sha256()
    for path in sorted(p for p in folder.rglob("*") if p.is_file() and p.relative_to(folder).parts[0].startswith(out)):
        if path.suffix == ".exr":
            found.update(images.read(path).pixels.tobytes())
        elif path.suffix == ".npz":
            with np.load(path) as archive:
                for name in sorted(archive.files):
                    if name != "manifest":
                        found.update(archive[name].tobytes())
        elif path.suffix == ".png":
            from PIL import Image

            found.update(np.asarray(Image.open(path)).tobytes())
    return found.hexdigest()


def damage(folder: Path, chance: random.Random) -> str:
    """Cut the newest file that a job has kept, at random; what was done, in words."""
    files = [p for p in folder.rglob("*") if p.is_file() and (p.name == "c" or p.suffix in (".part", ".checkpoint"))]
    if not files or chance.random() < 0.5:
        return ""
    newest = max(files, key=lambda path: path.stat().st_mtime_ns)
    if newest.name == "c" and not newest.with_name("c.previous").exists():
        return ""  # the first one: nothing to fall back to, and said so
    size = newest.stat().st_size
    length = chance.randrange(size + 1)
    os.truncate(newest, length)
    return f", {newest.name[:12]} cut to {length} of {size} bytes"


def trial(kind: str, folder: Path, seed: int, length: float, kills: int) -> tuple[bool, str]:
    """Whether a job that is killed so often gives the bits of one that is not, and what happened."""
    chance = random.Random(seed)
    folder.mkdir(parents=True, exist_ok=True)
    scene = folder / "scene.json"
    scene.write_text(json.dumps(SCENE))
    environment = {**os.environ, "GONIO_CACHE": str(folder / "cache")}
    begun = time.monotonic()
    whole = subprocess.run(
        [part if part != "c" else "whole" for part in command(kind, scene, "whole", length)],
        cwd=folder,
        env={**environment, "GONIO_CACHE": str(folder / "other")},
        capture_output=True,
        text=True,
    )
    took = time.monotonic() - begun
    if whole.returncode:
        return False, whole.stderr
    told, done = [], 0
    for attempt in range(40):
        process = subprocess.Popen(
            command(kind, scene, "killed", length),
            cwd=folder,
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        patience = chance.uniform(0.3, 1.0) * took if attempt < kills else 600.0
        try:
            _, warned = process.communicate(timeout=patience)
        except subprocess.TimeoutExpired:
            process.send_signal(signal.SIGKILL)
            process.communicate()
            done += 1
            told.append(f"killed after {patience:.1f} s{damage(folder, chance)}")
            continue
        if process.returncode:
            return False, warned
        told.append("went on" if "continues" in warned else "from the start")
        break
    same = content(folder, "killed") == content(folder, "whole")
    return same, f"{'same bits' if same else 'OTHER BITS'} ({took:.1f} s whole; {'; '.join(told)})"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=50)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--length", type=float, default=2.0, help="seconds of each job")
    parser.add_argument("--kills", type=int, default=3, help="times that each job is killed")
    options = parser.parse_args()
    failed = 0
    for run in range(options.runs):
        kind = list(KINDS)[run % len(KINDS)]
        with tempfile.TemporaryDirectory() as folder:
            same, told = trial(kind, Path(folder), options.seed + run, options.length, options.kills)
        failed += not same
        print(f"{run + 1:3} {kind:9} {told}", flush=True)
    print(f"{options.runs} runs, {failed} with other bits")
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main())
