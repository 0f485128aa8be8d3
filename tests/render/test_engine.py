"""Mitsuba's files on a machine of one processor, and with one thread."""

from __future__ import annotations

import json
from pathlib import Path

import gonio as go
import drjit as dr
import numpy as np
import pytest
from gonio.bridge import engine
from gonio.pictures import images

import one_cpu

PICTURES = """
import sys
import gonio as go, numpy as np
from gonio.render import images
picture = go.render(sys.argv[1], output="a.exr", spp=1)
assert np.array_equal(images.read("a.exr").pixels, picture)
np.save("picture.npy", picture)
import drjit as dr
import gonio as go
assert dr.thread_count() == 1, dr.thread_count()
xml = '''<scene version="3.0.0"><integrator type="direct"/>
<sensor type="perspective"><film type="hdrfilm">
<integer name="width" value="8"/><integer name="height" value="8"/></film></sensor>
<emitter type="envmap"><string name="filename" value="a.exr"/></emitter></scene>'''
open("scene.xml", "w").write(xml)
assert go.render("scene.xml", spp=1).max() > 0
print("done")
"""


@pytest.mark.slow
def test_exr_is_written_and_read_with_one_cpu(scene: Path, tmp_path: Path) -> None:
    done = one_cpu.run(PICTURES, scene, folder=tmp_path)
    assert done.stdout == "done\n", done.stderr
    # and the picture is the same to the bit
    here = np.load(tmp_path / "picture.npy")
    settings = json.loads((scene / "scene.json").read_text())
    assert here.shape == (*settings["camera"]["film"]["size"][::-1], 3)
    assert np.array_equal(here, images.read(tmp_path / "a.exr").pixels)


def test_one_thread_is_enough_for_exr(tmp_path: Path) -> None:
    engine.load()
    threads = dr.thread_count()
    engine.load(threads=1)
    try:
        images.write(tmp_path / "a.exr", np.ones((9, 7, 3), np.float32))
        assert images.read(tmp_path / "a.exr").pixels.shape == (9, 7, 3)
        assert dr.thread_count() == 1
    finally:
        dr.set_thread_count(threads)


def test_a_render_leaves_the_number_of_threads_as_it_was() -> None:
    threads = dr.thread_count()
    go.render(go.Lambert(), spp=1, size=(4, 4), threads=1 if threads > 1 else 2)
    assert dr.thread_count() == threads
