"""A Mitsuba scene reads what lies in its folder, and means what Mitsuba makes of it."""

from __future__ import annotations

import json
import time
from pathlib import Path

import numpy as np
import pytest
from gonio.bridge import engine
from gonio.errors import InputError
from gonio.scene import mitsuba_scene, mitsuba_xml
from gonio.verify import targets

PLY = """ply
format ascii 1.0
element vertex 3
property float x
property float y
property float z
element face 1
property list uchar int vertex_indices
end_header
0 0 0
1 0 0
0 1 0
3 0 1 %d
"""
MESH = '<shape type="ply"><string name="filename" value="%s"/></shape>'


def scene(folder: Path, content: str, version: str = "3.0.0") -> Path:
    """A file of a scene in a folder, whose neighbour `outside` has files that it must not read."""
    for place in (folder, folder.parent / "outside"):
        place.mkdir(exist_ok=True)
        (place / "good.ply").write_text(PLY % 2)
    (folder.parent / "outside" / "more.xml").write_text('<scene version="3.0.0"/>')
    (folder.parent / "outside" / "a.spd").write_text("400 0.5\n700 0.5\n")
    file = folder / "a.xml"
    file.write_text(f'<scene version="{version}">{content}</scene>')
    return file


@pytest.mark.parametrize(
    "content",
    [
        '<path value="../outside"/>' + MESH % "good.ply",
        MESH % "../outside/good.ply",
        MESH % "{outside}/good.ply",
        MESH % "link/good.ply",
        '<path value="link"/>' + MESH % "good.ply",
        MESH % "x.gltf#/../../outside/good.ply",
        '<default name="a" value="../outside/good.ply"/>' + MESH % "$a" + '<default name="a" value="good.ply"/>',
        '<include filename="../outside/more.xml"/>',
        '<include filename="{outside}/more.xml"/>',
        '<bsdf type="diffuse"><spectrum name="reflectance" filename="../outside/a.spd"/></bsdf>',
        '<bsdf type="gonio_measured"><string name="file" value="../outside/a.npz:gold"/></bsdf>',
    ],
)
def test_a_scene_reads_nothing_outside_its_folder(tmp_path: Path, content: str) -> None:
    file = scene(tmp_path / "scene", content.replace("{outside}", str(tmp_path / "outside")))
    (tmp_path / "scene" / "link").symlink_to(tmp_path / "outside")
    (tmp_path / "scene" / "x.gltf#").mkdir()
    with pytest.raises(InputError, match="outside the scene's folder") as caught:
        mitsuba_xml.read(file, {})
    assert "--allow-outside" in caught.value.hint
    if "a.npz" not in content:  # which does not exist
        mitsuba_xml.read(file, {}, allow_outside=True)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (MESH % "bare.ply", "'bare.ply' does not exist"),
        ('<include filename="bare.xml"/>', "'bare.xml' does not exist"),
        ('<path value="bare"/>', "no folder 'bare'"),
        ('<bsdf type="diffuse"><spectrum name="reflectance" filename="bare.spd"/></bsdf>', "does not exist"),
        ('<bsdf type="gonio_measured"><string name="file" value="bare.gonio"/></bsdf>', "does not exist"),
        ('<bsdf type="conductor"><string name="material" value="Bare"/></bsdf>', "Mitsuba has no material 'Bare'"),
        ('<bsdf type="conductor"><string name="material" value="../../bare"/></bsdf>', "Mitsuba has no material"),
    ],
)
def test_a_scene_reads_nothing_from_the_current_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, content: str, message: str
) -> None:
    file = scene(tmp_path / "scene", content)
    for name in ("bare.ply", "bare.xml", "bare.spd", "bare.gonio", "data/ior/Bare.eta.spd", "bare/x"):
        path = tmp_path / "here" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("1 1\n")
    monkeypatch.chdir(tmp_path / "here")
    for allowed in (False, True):
        with pytest.raises(InputError, match=message):
            mitsuba_xml.read(file, {}, allow_outside=allowed)


@pytest.mark.parametrize("content", ['<path value="sub"/>%s', '%s<path value="sub"/>'])
def test_a_file_in_a_search_path_is_checked(tmp_path: Path, content: str) -> None:
    file = scene(tmp_path / "scene", content % (MESH % "wild.ply"))
    sub = tmp_path / "scene" / "sub"
    sub.mkdir()
    (sub / "wild.ply").write_text(PLY % 2_000_000_000)
    with pytest.raises(InputError, match="a face names vertex 2000000000"):
        mitsuba_xml.read(file, {})


def test_a_scene_names_no_python(tmp_path: Path) -> None:
    file = scene(tmp_path / "scene", '<bsdf type="gonio_conductor"><string name="ndf" value="mine.py:GTR"/></bsdf>')
    with pytest.raises(InputError, match="is code, which a scene alone does not run"):
        mitsuba_xml.read(file, {})


def test_a_description_reads_nothing_outside_its_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "scene"
    scene(folder, "")
    monkeypatch.chdir(tmp_path / "outside")
    file = folder / "a.json"
    for name, message in (("../outside/a.spd", "outside the scene's folder"), ("a.spd", "'a.spd' does not exist")):
        texture = {"type": "bitmap", "filename": name}
        file.write_text(json.dumps({"type": "diffuse", "reflectance": texture}))
        with pytest.raises(InputError, match=message) as caught:
            targets.resolve(str(file))
        assert "--allow" not in caught.value.hint
    xml = folder / "b.xml"
    xml.write_text(
        '<bsdf version="3.0.0" type="diffuse"><spectrum name="reflectance" filename="../outside/a.spd"/></bsdf>'
    )
    with pytest.raises(InputError, match="outside the scene's folder"):
        targets.resolve(str(xml))


@pytest.mark.parametrize("version", ["3.0.0", "0.6.0"])
def test_a_scene_means_what_mitsuba_makes_of_it(tmp_path: Path, version: str) -> None:
    content = """
      <default name="kind" value="wrong"/><default name="albedo" value="$kind, 0.25"/>
      <path value="meshes"/>
      <include filename="sub/materials.xml"/>
      <bsdf type="diffuse" id="a &amp; &quot;b&quot; \\$"><rgb name="reflectance" value="0.5, $albedo"/></bsdf>
      <shape type="ply" id="mesh"><string name="filename" value="$file.ply"/><ref id="inner"/></shape>
      <shape type="sphere" id="ball"><ref id="other" name="bsdf"/><include filename="light.xml" name="lamp"/>
        <transform name="%s"><scale value="$size"/><translate x="1" y="2" z="3"/></transform></shape>"""
    file = scene(tmp_path / "scene", content % ("toWorld" if version[0] == "0" else "to_world"), version)
    folder = file.parent
    for name in ("meshes", "sub"):
        (folder / name).mkdir()
    (folder / "meshes" / "m.ply").write_text(PLY % 2)
    (folder / "sub" / "c.spd").write_text("400 0.1\n700 0.7\n")
    (folder / "sub" / "materials.xml").write_text(
        f'<scene version="{version}"><include filename="one.xml"/><alias id="inner" as="other"/>'
        '<default name="size" value="2"/></scene>'
    )
    (folder / "sub" / "one.xml").write_text(
        f'<bsdf version="{version}" type="diffuse" id="inner">'
        '<spectrum name="reflectance" filename="sub/c.spd"/></bsdf>'
    )
    (folder / "light.xml").write_text(
        f'<emitter version="{version}" type="area"><rgb name="radiance" value="1,$size,3"/></emitter>'
    )
    values = {"kind": "0.75", "file": "m"}
    mi = engine.load("cpu")
    theirs = mi.load_file(str(file), parallel=False, optimize=False, **values)
    text = mitsuba_xml.read(file, values)
    ours = mitsuba_scene.instantiated(text, folder, mi)
    assert sorted(text.files) == ["light.xml", "meshes/m.ply", "sub/c.spd", "sub/materials.xml", "sub/one.xml"]
    one, other = mi.traverse(theirs), mi.traverse(ours)
    assert sorted(one.keys()) == sorted(other.keys()) and 'a & "b" $.reflectance.value' in one.keys()  # noqa: SIM118
    for key in one.keys():  # noqa: SIM118 - a map of Mitsuba's
        if not isinstance(one[key], (str, bool)) and hasattr(one[key], "shape"):
            np.testing.assert_array_equal(np.array(one[key]), np.array(other[key]), key)


@pytest.mark.parametrize(
    ("content", "message", "place"),
    [
        (
            '<shape\ntype="sphere"><bsdf type="diffuse">\n\n<float name="a" value="1"/></bsdf></shape>',
            "a.xml, line 2",
            "",
        ),
        ('\n<include filename="b.xml"/>', "b.xml, line 3", ""),
        ('\n<path value="no"/>', "no folder 'no'", "a.xml:2"),
        ('<float name="x" value="$here"/>', r"the parameter \$here has no value", "a.xml:1"),
        ('<shape type="cube"><path value="."/></shape>', "inside another element", "a.xml:1"),
        ('<default name="x"/>', "<default> has no value", "a.xml:1"),
        ('<default name="x" value="1"><float/></default>', "an element that cannot contain other elements", "a.xml:1"),
        ('<include filename="c.xml"/>', "begins with <float>", "c.xml:1"),
        ('<include filename="d.xml"/>', "of version 0.6.0 is included in a scene of version 3.0.0", "d.xml:1"),
        ('<include filename="a.xml"/>', "more than 15 nested includes", "a.xml:1"),
    ],
)
def test_an_error_names_the_users_line(tmp_path: Path, content: str, message: str, place: str) -> None:
    file = scene(tmp_path / "scene", content)
    (file.parent / "b.xml").write_text(
        '<scene version="3.0.0">\n\n<shape type="sphere" id="x"><float name="a" value="1"/></shape></scene>'
    )
    (file.parent / "c.xml").write_text('<float name="x" value="1"/>')
    (file.parent / "d.xml").write_text('<scene version="0.6.0"/>')
    with pytest.raises(InputError, match=message) as caught:
        mitsuba_scene.load(engine.load("cpu"), file, mitsuba_scene.read(file, {}))
    assert caught.value.where.endswith(place)


def test_what_a_scene_grows_to_is_bounded(tmp_path: Path) -> None:
    chain = "".join(f'<default name="a{n}" value="{f"$a{n - 1}" * 16 if n else "x" * 16}"/>' for n in range(11))
    with pytest.raises(InputError, match="make the text too long"):
        mitsuba_xml.read(scene(tmp_path / "scene", chain), {})
    with pytest.raises(InputError, match="more than 64 nested elements"):
        mitsuba_xml.read(scene(tmp_path / "scene", '<shape type="cube">' * 10_000 + "</shape>" * 10_000), {})
    with pytest.raises(InputError, match="a parameter's name of 5000 characters"):
        mitsuba_xml.read(scene(tmp_path / "scene", f'<default name="{"a" * 5000}" value="1"/>'), {})
    file = scene(tmp_path / "scene", "")
    file.write_text('<!DOCTYPE a [<!ENTITY b "x">]><scene version="3.0.0"/>')
    with pytest.raises(InputError, match="declares a document type"):
        mitsuba_xml.read(file, {})


def test_many_parameters_take_no_longer_than_few(tmp_path: Path) -> None:
    names = [f"n{'x' * (n % 50)}{n}" for n in range(5_000)]
    content = "".join(f'<default name="{name}" value="{n}"/>' for n, name in enumerate(names))
    content += "".join(f'<integer name="i{n}" value="${name}"/>' for n, name in enumerate(names))
    start = time.process_time()
    text = mitsuba_xml.read(scene(tmp_path / "scene", content), {}).text
    assert time.process_time() - start < 2.0  # 0.1 s; 40 s where each name is searched for in each value
    assert all(f'name="i{n}" value="{n}"' in text for n in (0, 17, 4_999))


def test_the_longest_name_of_a_parameter_counts_and_its_value_is_no_name(tmp_path: Path) -> None:
    content = '<default name="a" value="1"/><default name="ab" value="2$a"/><string name="x" value="$ab$a.$abc\\$a"/>'
    assert '<string name="x" value="211.21c\\$a">' in mitsuba_xml.read(scene(tmp_path / "scene", content), {}).text


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    ("count", "last", "message"),
    [
        (60, '<bsdf type="diffuse" id="a60"/>', ""),
        (20_000, '<bsdf type="diffuse" id="a20000"/>', "references are chained 20000 times"),
        (1, '<bsdf type="twosided" id="a1"><ref id="a1"/></bsdf>', "is part of itself"),
        (20_000, '<alias id="a0" as="a20000"/>', "is part of itself"),
    ],
)
def test_references_are_bounded_before_mitsuba_follows_them(
    count: int, last: str, message: str, tmp_path: Path
) -> None:
    content = "".join(f'<bsdf type="twosided" id="a{n}"><ref id="a{n + 1}"/></bsdf>' for n in range(count)) + last
    file = scene(tmp_path / "scene", content)
    if not message:
        mitsuba_xml.read(file, {})
        return
    with pytest.raises(InputError, match=message):
        mitsuba_xml.read(file, {})
