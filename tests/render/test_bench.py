"""`gonio doctor --bench`: a short table for users to send."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from gonio import cli
from gonio.bridge import engine
from gonio.render import bench


@pytest.mark.slow
def test_the_table_has_rays_a_material_and_integrators_beside_mitsubas(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for name, value in (("LANES", {"llvm": 256}), ("SIZE", {"llvm": 16}), ("SPP", 1), ("ROUNDS", 1)):
        monkeypatch.setattr(bench, name, value)
    with pytest.raises(SystemExit) as caught:
        cli.main(["doctor", "--bench", "--device", "cpu", "--json"])
    assert not caught.value.code
    found = json.loads(capsys.readouterr().out)
    assert [row["what"] for row in found["rows"]] == ["rays", "eval", "sample", "direct", "path"]
    assert all(row["mitsuba"] > 0 for row in found["rows"])
    assert all(row["gonio"] > 0 for row in found["rows"][1:])
    assert "llvm" in found["machine"] and "threads" in found["machine"]


@pytest.mark.slow
@pytest.mark.skipif(engine.cuda_available(), reason="there is a GPU")
def test_without_a_gpu_its_tests_say_so_loudly_and_fail() -> None:
    root = Path(__file__).parents[2]
    environment = {**os.environ, "PYTHONPATH": str(root / "src")}
    # the recipe's own line, without `make`, which would first install
    recipe = (root / "Makefile").read_text().split("test-gpu: .venv/installed\n")[1].split("\n\n")[0]
    line = (
        recipe.split("GONIO_TEST_DEVICE")[0].replace("\t", "").replace("@", "").replace("$(BIN)/python", sys.executable)
    )
    done = subprocess.run(["sh", "-c", line], capture_output=True, text=True, env=environment, cwd=root)
    assert done.returncode == 1 and "NOTHING WAS TESTED" in done.stderr
