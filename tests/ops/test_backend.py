"""The interface to Dr.Jit."""

from __future__ import annotations

from pathlib import Path

import pytest
from gonio.errors import MachineError
from gonio.ops import backend


def test_kernels_that_others_may_change_are_not_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.delenv("DRJIT_CACHE_DIR", raising=False)
    kept = tmp_path / ".drjit"
    backend.check_kernels()
    kept.mkdir(mode=0o755)
    backend.check_kernels()
    kept.chmod(0o777)
    with pytest.raises(MachineError, match="other users may change the kernels") as caught:
        backend.check_kernels()
    assert f"chmod go-w '{kept}'" in caught.value.hint
    monkeypatch.setenv("DRJIT_CACHE_DIR", str(tmp_path))
    backend.check_kernels()
