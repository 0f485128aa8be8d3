"""An .npz of anybody's gives arrays or one reason, and never unpacks to what it does not hold."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path

import numpy as np
import pytest
from gonio import archives
from gonio.errors import InputError
from gonio.pictures import images


def test_arrays_come_back_as_they_were(tmp_path: Path) -> None:
    given = {
        "a": np.arange(12.0).reshape(3, 4),
        "fortran": np.asfortranarray(np.arange(6, dtype=">i4").reshape(2, 3)),
        "text": np.array("müll"),
        "none": np.zeros((0, 3)),
    }
    np.savez_compressed(tmp_path / "a.npz", **given)
    found = archives.read(tmp_path / "a.npz")
    assert found.keys() == given.keys()
    for name, array in given.items():
        np.testing.assert_array_equal(found[name], array)
    assert archives.read(tmp_path / "a.npz", ["a", "b"]).keys() == {"a"}


@pytest.mark.slow
def test_three_megabytes_do_not_take_six_gigabytes(tmp_path: Path) -> None:
    path = tmp_path / "bomb.npz"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive, archive.open("radiance.npy", "w") as file:
        header = io.BytesIO()
        np.lib.format.write_array_header_1_0(
            header, {"descr": "<f4", "fortran_order": False, "shape": (1 << 13, 1 << 13, 3)}
        )
        file.write(header.getvalue())
        for _ in range(3 << 4):
            file.write(bytes(1 << 24))
    with pytest.raises(archives.Unreadable, match="unpacks to 768 MiB"):
        archives.read(path)
    with pytest.raises(InputError, match="unpacks to"):
        images.read(path)


def test_a_claim_beyond_the_bytes_is_refused(tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", radiance=np.zeros((4, 4, 3), np.float32))
    content = (tmp_path / "a.npz").read_bytes().replace(b"(4, 4, 3)", b"(4, 9, 3)")
    (tmp_path / "a.npz").write_bytes(content)
    with pytest.raises(archives.Unreadable):
        archives.read(tmp_path / "a.npz")


def test_an_unknown_version_of_zip_and_objects_are_reasons(tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", radiance=np.zeros((4, 4, 3), np.float32))
    content = bytearray((tmp_path / "a.npz").read_bytes())
    content[content.index(b"PK\x01\x02") + 6] = 99
    (tmp_path / "a.npz").write_bytes(content)
    with pytest.raises(InputError, match="zip file version"):
        images.read(tmp_path / "a.npz")
    np.savez(tmp_path / "b.npz", radiance=np.array([{"a": 1}], dtype=object))
    with pytest.raises(archives.Unreadable, match="never loaded"):
        archives.read(tmp_path / "b.npz")
