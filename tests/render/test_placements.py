"""Surfaces of many shapes: what the array of placements tells is what each shape would have told."""

import json

import gonio as go
import drjit as dr
import numpy as np
import pytest
from gonio.bridge import engine
from gonio.transport import surfaces
from gonio.transport.fast import placements


def _placed(mi, rng, *scale):
    axis = rng.normal(size=3)
    turned = mi.ScalarTransform4f().translate(list(rng.uniform(-3, 3, 3)))
    turned = turned.rotate(list(axis / np.linalg.norm(axis)), rng.uniform(0, 360))
    return turned.scale(list(scale)) if len(scale) > 1 else turned.scale(scale[0])


@pytest.fixture(scope="module")
def met():
    """What 50,000 rays find in a heap of spheres, rectangles, a cube and a disk: by Mitsuba, and by Gonio."""
    mi, rng = engine.load(), np.random.default_rng(5)
    scene = {"type": "scene", "cube": {"type": "cube"}, "disk": {"type": "disk", "to_world": _placed(mi, rng, 2.0)}}
    for index in range(placements.MANY):
        flip = {"flip_normals": index % 3 == 0}
        size = rng.uniform(0.2, 0.8)
        scene[f"sphere{index}"] = {"type": "sphere", **flip, "to_world": _placed(mi, rng, size)}
        scene[f"rectangle{index}"] = {"type": "rectangle", **flip, "to_world": _placed(mi, rng, size, 0.5, 1.0)}
    scene = mi.load_dict(scene)
    start, end = rng.normal(size=(3, 50_000)), rng.uniform(-3, 3, (3, 50_000))
    start *= 6 / np.linalg.norm(start, axis=0)
    ray = mi.Ray3f(mi.Point3f(start), dr.normalize(mi.Vector3f(end - start)))
    hit = scene.ray_intersect_preliminary(ray)
    ours = surfaces.Surfaces(mi, scene)
    table = ours.placements
    assert table is not None and table.kinds == ["Sphere", "Rectangle"] and len(table.others) == 2
    found = hit.compute_surface_interaction(ray), ours.interaction(hit, ray)
    dr.eval(found)
    yield found


@pytest.mark.parametrize("name", ["t", "p", "n", "uv", "dp_du", "dp_dv", "wi"])
def test_the_placements_tell_of_a_surface_what_the_shape_would(met, name):
    theirs, ours = met
    valid = np.array(theirs.is_valid())
    assert 0.5 < valid.mean() < 1
    theirs, ours = (np.array(getattr(si, name)).reshape(-1, len(valid))[:, valid] for si in (theirs, ours))
    assert np.abs(theirs - ours).max() <= 3e-4 * np.abs(theirs).max()


def test_the_placements_tell_whose_surface_it_is_and_its_frame(met):
    theirs, ours = met
    for name in ("shape", "instance"):
        assert dr.all(getattr(theirs, name) == getattr(ours, name))
    for axis in "stn":
        difference = getattr(theirs.sh_frame, axis) - getattr(ours.sh_frame, axis)
        assert dr.all(dr.norm(dr.select(ours.is_valid(), difference, 0)) < 3e-4)
    assert dr.all(ours.is_valid() == theirs.is_valid())


def test_a_picture_of_many_spheres_is_that_of_each_by_itself(tmp_path, monkeypatch):
    scene = {
        "output": {"filename": "many.png"},
        "sampler": {"type": "independent", "samples": 16},
        "integrator": {"type": "path", "maxDepth": 4},
        "camera": {
            "type": "pinhole",
            "transform": {"position": [0, 0, 8], "lookAt": [0, 0, 0], "up": [0, 1, 0]},
            "verticalFov": 40,
            "film": {"size": [60, 40]},
        },
        "scene": {
            "shapes": [
                {
                    "type": "sphere",
                    "center": [x - 4, y - 4, 0],
                    "radius": 0.4,
                    "material": {"type": "gonio-conductor", "alpha": [0.1, 0.5]},
                }
                for x in range(9)
                for y in range(9)
            ],
            "lights": [
                {"type": "environmentLight", "texture": [1, 0.5, 0.2]},
                {"type": "spotLight", "position": [3, 9, 9], "energy": [99, 99, 99]},
            ],
        },
    }
    file = tmp_path / "many.json"
    file.write_text(json.dumps(scene))
    together = go.render(file, spp=16, seed=1)
    monkeypatch.setattr(surfaces, "MANY", 10**6)
    apart = go.render(file, spp=16, seed=1)
    assert not np.array_equal(together, apart)  # else the monkeypatch did nothing
    assert np.abs(together - apart).mean() < 1e-3 * apart.mean()
