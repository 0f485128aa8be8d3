"""Rays in the kernel: what they meet is what Mitsuba's rays meet."""

from pathlib import Path

import gonio as go
import drjit as dr
import numpy as np
import pytest
from gonio.bridge import engine
from gonio.transport import surfaces
from gonio.transport.fast import inline

RAYS = 50_000


def turned(mi, *, at=(0.0, 0.0, 0.0), angle=40.0, scale=(1.0, 1.0, 1.0)):
    place = mi.ScalarTransform4f().translate(list(at)).rotate([0.48, 0.6, 0.64], angle)
    return place.scale(list(scale))


def shapes(mi):
    """Scenes whose shapes differ in kind."""
    flat = {"type": "rectangle", "to_world": turned(mi, at=(0.5, 0, -1), scale=(0.5, 1.2, 1))}
    walls = {
        f"wall{i}": {"type": "rectangle", "to_world": turned(mi, angle=90.0 * i, at=(i - 1, 0, 1))} for i in range(3)
    }
    one = {"type": "diffuse", "id": "one"}
    return {
        "sphere": {"a": {"type": "sphere", "to_world": turned(mi, at=(0.3, -0.2, 0.5), scale=[0.7] * 3)}},
        "inward": {"a": {"type": "sphere", "radius": 1.5, "flip_normals": True}, "b": {**flat, "flip_normals": True}},
        "rectangle": {"a": flat},
        "sheared": {
            "a": {
                **flat,
                "to_world": mi.ScalarTransform4f([[1, 0.5, 0, 0], [0, 1, 0, 0], [0, 0.2, 1, 0], [0, 0, 0, 1]]),
            }
        },
        "disk": {"a": {"type": "disk", "to_world": turned(mi, scale=(1, 2, 1))}},
        "cube": {"a": {"type": "cube", "to_world": turned(mi, scale=(0.5, 1, 0.8))}},
        "merged": {
            "one": one,
            **{name: {**wall, "bsdf": {"type": "ref", "id": "one"}} for name, wall in walls.items()},
        },
        "all": {
            "a": {"type": "sphere", "radius": 0.6},
            "b": {**flat, "emitter": {"type": "area"}},
            "c": {"type": "disk", "to_world": turned(mi, at=(-1, 0, 0))},
            "d": {"type": "cube", "to_world": turned(mi, at=(1, 1, 0), scale=[0.4] * 3)},
            "e": {"type": "sphere", "center": [30, 0, 0], "radius": 27},
        },
    }


KINDS = ("sphere", "inward", "rectangle", "sheared", "disk", "cube", "merged", "all")


def loaded(kind):
    mi = engine.load()
    return mi, mi.load_dict({"type": "scene", **shapes(mi)[kind]})


def rays(mi, seed=1):
    rng = np.random.default_rng(seed)
    start, end = rng.normal(size=(3, RAYS)) * 2, rng.uniform(-1, 1, (3, RAYS))
    return mi.Ray3f(mi.Point3f(start), dr.normalize(mi.Vector3f(end - start)))


@pytest.mark.sample(2)
@pytest.mark.parametrize("kind", KINDS)
def test_rays_meet_what_mitsubas_meet(kind):
    mi, scene = loaded(kind)
    ours = surfaces.Surfaces(mi, scene)
    assert ours.inline is not None
    ray = rays(mi)
    theirs, hit = scene.ray_intersect_preliminary(ray), ours.nearest(ray)
    same = np.array(theirs.shape == hit.shape)
    assert same.mean() > 1 - 1e-4  # rays along an edge may go either way
    met = same & np.array(hit.is_valid())
    assert met.mean() > 0.1
    a, b = theirs.compute_surface_interaction(ray), ours.interaction(hit, ray)
    for name in ("t", "p", "n", "uv", "dp_du", "dp_dv", "wi"):
        x, y = (np.array(getattr(si, name)).reshape(-1, RAYS)[:, met] for si in (a, b))
        scale = np.abs(x).max()
        off = np.abs(x - y).max(0)
        if name == "uv":
            off = np.minimum(off, np.abs(off - 1))  # where a sphere's u begins again
        assert np.quantile(off, 0.999) <= 3e-5 * scale and off.max() <= 1e-2 * scale, name
    assert not dr.any(hit.is_valid() & (hit.t <= 0))
    if kind in ("cube", "merged"):  # two faces that are one shape here are told apart
        assert np.mean(np.array(theirs.prim_index == hit.prim_index)[met]) > 1 - 1e-3
        off = np.abs(np.array(theirs.prim_uv) - np.array(hit.prim_uv))[:, met].max(0)
        assert np.quantile(off, 0.99) < 1e-4


@pytest.mark.parametrize("kind", KINDS)
def test_rays_are_blocked_where_mitsubas_are(kind):
    mi, scene = loaded(kind)
    ours, ray = surfaces.Surfaces(mi, scene), rays(mi, 2)
    ray.maxt = mi.Float(np.random.default_rng(3).uniform(0, 4, RAYS))
    awake = mi.Bool(np.random.default_rng(4).random(RAYS) < 0.9)
    theirs, blocked = (np.array(x) for x in (scene.ray_test(ray, awake), ours.blocked(ray, awake)))
    assert 0.01 < theirs.mean() < 0.9
    assert (theirs == blocked).mean() > 1 - 1e-4
    assert not blocked[~np.array(awake)].any()
    hit = ours.nearest(ray, awake)
    assert dr.all(hit.is_valid() == mi.Bool(blocked))


@pytest.mark.parametrize("radius", [0.001, 1.0, 20.0])
@pytest.mark.parametrize("away", [0.0, 3.0, 300.0])
def test_a_ray_that_leaves_a_sphere_does_not_meet_it_where_it_starts(radius, away):
    """Outside it is gone; inside it meets the other side, a chord of 2 r cos away."""
    mi = engine.load()
    scene = mi.load_dict(
        {"type": "scene", "a": {"type": "sphere", "radius": radius, "center": [away, -away, 0.5 * away]}}
    )
    ours = surfaces.Surfaces(mi, scene)
    assert ours.inline is not None
    rng = np.random.default_rng(5)
    axis, toward = (x / np.linalg.norm(x, axis=0) for x in rng.normal(size=(2, 3, RAYS)))
    si = dr.zeros(mi.SurfaceInteraction3f, RAYS)
    centre = np.array([away, -away, 0.5 * away])[:, None]
    si.p, si.n = mi.Point3f(centre + radius * axis), mi.Normal3f(axis)
    ray = si.spawn_ray(mi.Vector3f(toward))
    cosine = (axis * toward).sum(0)
    hit = ours.nearest(ray)
    offset = 1e-4 * (1 + 2 * away + radius)
    clear = np.abs(cosine) > 0.01 + 4 * np.sqrt(offset / radius)
    assert clear.any() or radius < offset * 20
    found = np.array(hit.is_valid())
    assert not found[clear & (cosine > 0)].any()
    inside = clear & (cosine < 0)
    assert found[inside].all()
    chord = -2 * radius * cosine
    off = np.abs(np.array(hit.t) - chord)
    assert np.all(off[inside] <= (2 * offset / np.abs(cosine) + 1e-4 * radius)[inside])


@pytest.mark.parametrize("more", [
    {"a": {"type": "cylinder"}},
    {"a": {"type": "sphere", "radius": 1e4, "center": [0, -1e4, 0]}},
    {f"b{i}": {"type": "sphere", "center": [i, 0, 0], "radius": 0.1} for i in range(40)},
], ids=["another shape", "too large for 32 bits", "many"])  # fmt: skip
def test_other_scenes_are_left_to_mitsuba(more):
    mi = engine.load()
    assert surfaces.Surfaces(mi, mi.load_dict({"type": "scene", "s": {"type": "sphere"}, **more})).inline is None


def test_the_order_of_shapes_makes_no_difference():
    mi = engine.load()
    described = list(shapes(mi)["all"].items())
    found = []
    for order in (described, described[::-1]):
        scene = mi.load_dict({"type": "scene", **dict(order)})
        ours = surfaces.Surfaces(mi, scene).inline
        assert ours is not None
        hit = ours.nearest(rays(mi), mi.Bool(True))
        kinds = [(flat.kind, flat.faces, flat.rows) for flat, _ in ours.flats]
        found.append(
            (kinds, [[float(x[0]) for x in (*centre, radius)] for centre, radius in ours.spheres], np.array(hit.t))
        )
    assert found[0][:2] == found[1][:2]
    assert np.array_equal(found[0][2], found[1][2])


def test_a_scene_of_faces_without_an_area_is_left_to_mitsuba():
    mi = engine.load()
    mesh = mi.Mesh("thin", 3, 1)
    values = mi.traverse(mesh)
    values["vertex_positions"], values["faces"] = [0, 0, 0, 1, 0, 0, 2, 0, 0], [0, 1, 2]
    values.update()
    ours = surfaces.Surfaces(mi, mi.load_dict({"type": "scene", "mesh": mesh}))
    assert ours.inline is None
    assert not dr.any(ours.nearest(rays(mi)).is_valid())


def test_a_face_without_an_area_is_never_met():
    mi = engine.load()
    mesh = mi.Mesh("thin", 4, 2)
    values = mi.traverse(mesh)
    values["vertex_positions"] = [0, 0, 0, 1, 0, 0, 0, 1, 0, 2, 0, 0]
    values["faces"] = [0, 1, 2, 0, 1, 3]
    values.update()
    scene = mi.load_dict({"type": "scene", "mesh": mesh})
    ours = surfaces.Surfaces(mi, scene)
    assert ours.inline is not None and len(ours.inline.flats) == 1
    ray = mi.Ray3f(mi.Point3f([0.2, 0.9, 1.5], [0.2, 0.9, 0.0], 1), mi.Vector3f(0, 0, -1))
    assert np.array(ours.nearest(ray).is_valid()).tolist() == [True, False, False]


@pytest.mark.parametrize("name", ["conductor-ggx", "rough-dielectric"])
def test_pictures_are_those_of_mitsubas_rays(name, monkeypatch):
    scene = Path(__file__).parents[2] / "examples" / name
    ours = go.render(scene, size=(64, 48), spp=4)
    monkeypatch.setattr(inline, "MAX_COST", 0)
    theirs = go.render(scene, size=(64, 48), spp=4)
    assert not np.array_equal(ours, theirs)  # the last bits: they were traced apart
    off = np.abs(ours - theirs).max(-1)
    assert (off > 1e-3 * theirs.mean()).mean() < 0.01
    assert ours.mean() == pytest.approx(theirs.mean(), rel=1e-3)
