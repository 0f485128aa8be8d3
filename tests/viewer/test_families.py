"""`gonio explain` knows every member of every family, and the families."""

from __future__ import annotations

import json
import re
from pathlib import Path

import gonio
import pytest
from gonio import cli
from gonio.viewer import families


def test_every_family_is_listed() -> None:
    """But verbs, which have `--help`."""
    source = Path(gonio.__file__).parent
    made = [
        match[1]
        for path in source.rglob("*.py")
        for match in re.finditer(r"^(\w+)\.family = Family\(", path.read_text(), re.MULTILINE)
    ]
    assert sorted(made) == sorted([home.base for home in families.HOMES] + ["Verb"])


@pytest.mark.parametrize("kind", [kind for kind in families.families() if kind != "material"])
def test_every_member_has_a_page(kind: str) -> None:
    family, _ = families.families()[kind]
    for name in family.all():
        page = next(
            page for page in families.pages(name) if isinstance(page, families.MemberPage) and page.kind == kind
        )
        assert page.doc and page.text(80) and Path(page.source).suffix == ".py"
    listed = families.pages(kind)[0]
    assert isinstance(listed, families.FamilyPage) and listed.members == family.titles()


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("ggx", ["ggx (microfacet distribution)", "alpha_x^2", "--param ndf=ggx"]),
        ("smith-correlated", ["masking term", "1 / (1 + Lambda(wo) + Lambda(wi))", "masking/smith_correlated.py"]),
        ("fresnel", ["Fresnel kinds", "f82", "schlick", "--param fresnel=NAME"]),
        ("masking terms", ["v-groove"]),
        ("distributions", ["beckmann", "student-t"]),
        ("path", ["integrator", "--integrator path"]),
        ("reciprocity", ["law", "--law reciprocity"]),
        ("", ["masking terms", "integrators", "laws"]),
        ("conductor", ["Mitsuba plugin: gonio_conductor"]),
        ("conductor(alpha=.3)", ["Mitsuba plugin: gonio_conductor"]),
    ],
)
def test_it_is_printed(name: str, words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run(["explain", name] if name else ["explain"]) == 0
    out = capsys.readouterr().out
    assert all(word in out for word in words), out
    assert cli.run(["explain", *filter(None, [name]), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["name"]


def test_what_is_none_gets_a_hint(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run(["explain", "smith-corelated"]) == 2
    assert "did you mean 'smith-correlated'?" in capsys.readouterr().err


def test_a_part_in_a_file_is_used_by_the_name_that_commands_take(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "parts.py").write_text(
        "import gonio as go\nclass Hazy(go.NDF):\n    def D(self, m, alpha):\n        return m.z * go.ops.inv_pi\n"
    )
    assert cli.run(["explain", f"{tmp_path}/parts.py:Hazy"]) == 0
    assert f"Use: --param ndf={tmp_path}/parts.py:Hazy" in capsys.readouterr().out
