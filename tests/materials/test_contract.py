"""The Python contract: what goes in and comes out, every form of a parameter, every error."""

from __future__ import annotations

import dataclasses
import warnings
from typing import Any

import gonio as go
import numpy as np
import pytest
from gonio.errors import InputError
from gonio.ops import backend

from materials import ALL, COMPOSED, SMALL
from sphere import at, random_directions, random_numbers

N = 7
WO, WI, U = random_directions(N, 91, upper=True), random_directions(N, 92, upper=True), random_numbers(N, 91)


@pytest.mark.sample(8)
@pytest.mark.parametrize("precision, dtype", [("float32", np.float32), ("float64", np.float64)])
@pytest.mark.parametrize("name", SMALL)
def test_shapes_and_types_of_answers(name: str, precision: str, dtype: type) -> None:
    material = SMALL[name]
    for wo, wi, u in ((WO, WI, U), (WO.tolist(), WI.tolist(), U.tolist())):
        for method in (material.eval, material.f):
            value = method(wo, wi, precision=precision)
            assert type(value) is np.ndarray and value.shape == (N, 3) and value.dtype == dtype
        pdf = material.pdf(wo, wi, precision=precision)
        assert pdf.shape == (N,) and pdf.dtype == dtype
        s = material.sample(wo, u, precision=precision)
        assert s._fields == ("wi", "weight", "pdf", "delta", "eta")
        assert [x.shape for x in s] == [(N, 3), (N, 3), (N,), (N,), (N,)]
        assert [x.dtype for x in s] == [dtype, dtype, dtype, np.bool_, dtype]


@pytest.mark.sample(8)
@pytest.mark.parametrize("name", SMALL)
def test_drjit_vectors_give_drjit_values(name: str) -> None:
    material = SMALL[name]
    for precision in ("float32", "float64"):
        kind = backend.types(precision)
        wo, wi, u = (backend.vector_of(x, 3, kind) for x in (WO, WI, U))
        value, pdf, s = material.eval(wo, wi), material.pdf(wo, wi), material.sample(wo, u)
        assert all(backend.is_drjit(x) for x in (value, pdf, *s))
        expected = material.eval(WO, WI, precision=precision)
        np.testing.assert_allclose(np.broadcast_to(value.numpy().T, (N, 3)), expected, rtol=1e-5)
        f = material.f(wo, wi)
        np.testing.assert_allclose(
            np.broadcast_to(f.numpy().T, (N, 3)), material.f(WO, WI, precision=precision), rtol=1e-5, atol=1e-7
        )


def test_single_directions_count_as_one_row_and_spread_over_many() -> None:
    assert go.Lambert().eval(at(0), at(10)).shape == (1, 3)
    assert go.Lambert().eval(at(0), WI).shape == (N, 3)
    assert go.Lambert().pdf(WO, at(10)).shape == (N,)
    assert go.Conductor().sample(at(0), U).wi.shape == (N, 3)


def test_no_rows_are_no_answer_but_no_error() -> None:
    none = np.zeros((0, 3))
    assert go.Lambert().eval(none, none).shape == (0, 3)


def test_precision_is_set_for_all_or_for_one_call() -> None:
    assert go.get_precision() == "float32"
    go.set_precision("float64")
    assert go.Lambert().eval(WO, WI).dtype == np.float64
    assert go.Lambert().eval(WO, WI, precision="float32").dtype == np.float32
    with pytest.raises(go.InputError, match="unknown precision 'half'"):
        go.set_precision("half")
    with pytest.raises(go.InputError, match="unknown precision 'half'"):
        go.Lambert().eval(WO, WI, precision="half")


@pytest.mark.parametrize("form", ["number", "array", "pair", "pair of arrays", "numpy number", "drjit"])
def test_width_takes_every_form(form: str) -> None:
    a = np.linspace(0.1, 0.7, N)
    kind = backend.types("float64")
    forms: dict[str, tuple[Any, list[Any]]] = {
        "number": (0.3, [0.3] * N),
        "numpy number": (np.float32(0.25), [0.25] * N),
        "array": (a, list(a)),
        "pair": ((0.2, 0.5), [(0.2, 0.5)] * N),
        "pair of arrays": ((a, 0.8 - a), list(zip(a, 0.8 - a, strict=True))),
        "drjit": (kind.float(a), list(a)),
    }
    alpha, each = forms[form]
    for cls in (go.Conductor, go.Dielectric):
        together = cls(alpha=alpha).eval(WO, WI, precision="float64")
        apart = [cls(alpha=one).eval(WO[i], WI[i], precision="float64")[0] for i, one in enumerate(each)]
        np.testing.assert_allclose(together, apart, rtol=1e-12)
        assert cls(alpha=alpha).sample(WO, U, precision="float64").wi.shape == (N, 3)


def test_one_value_a_ray_for_colours_angles_and_numbers() -> None:
    colours = np.linspace(0, 1, 3 * N).reshape(N, 3)
    np.testing.assert_allclose(go.Lambert(colours).f(WO, WI, precision="float64"), colours / np.pi, rtol=1e-12)
    turns, sigma = np.linspace(-1, 1, N), np.linspace(0, 1, N)
    for i in range(N):
        for many, one in (
            (go.Conductor(alpha=(0.1, 0.4), rotation=turns), go.Conductor(alpha=(0.1, 0.4), rotation=float(turns[i]))),
            (go.OrenNayar(0.5, sigma), go.OrenNayar(0.5, float(sigma[i]))),
            (go.Dielectric(1.2 + 0.1 * sigma, 0.3), go.Dielectric(1.2 + 0.1 * float(sigma[i]), 0.3)),
        ):
            expected = one.eval(WO[i], WI[i], precision="float64")[0]
            np.testing.assert_allclose(many.eval(WO, WI, precision="float64")[i], expected, rtol=1e-10)


def test_smooth_and_rough_rays_may_be_mixed() -> None:
    glass = go.Dielectric(1.5, np.array([0.0, 0.3] * 3 + [0.0]))
    assert glass.delta == "maybe"
    s = glass.sample(WO, U)
    np.testing.assert_array_equal(s.delta, [True, False] * 3 + [True])


def test_mode_is_radiance_or_importance() -> None:
    with pytest.raises(go.InputError, match=r"unknown mode 'photons'.*\n.*radiance or importance"):
        go.Lambert().eval(WO, WI, "photons")
    value = go.Dielectric().eval(WO, WI * [1, 1, -1])
    scaled = go.Dielectric().eval(WO, WI * [1, 1, -1], mode="importance")
    np.testing.assert_allclose(scaled, value * 2.25, rtol=1e-5)


@pytest.mark.parametrize("wo, wi, text", [
    (np.zeros((3, 2)), WI, r"eval: wo: an array of shape \(3, 2\), expected \(N, 3\)"),
    (WO, np.zeros((2, 2, 4)), r"eval: wi: an array of shape \(2, 2, 4\)"),
    (WO, WI[:4], "4 and 7 rows given, the same number expected"),
    ("up", WI, "eval: wo: an array of shape"),
])  # fmt: skip
def test_wrong_shapes_are_one_clear_error(wo: Any, wi: Any, text: str) -> None:
    with pytest.raises(go.InputError, match=text):
        go.Lambert().eval(wo, wi)


def test_wrong_numbers_for_sample_are_named_u() -> None:
    with pytest.raises(go.InputError, match=r"sample: u: an array of shape \(7, 2\)"):
        go.Lambert().sample(WO, np.zeros((7, 2)))


@pytest.mark.parametrize("make, text", [
    (lambda: go.Conductor(alpha=-0.1), r"Conductor\.alpha: -0\.1 given, >= 0 and <= 1 expected"),
    (lambda: go.Conductor(alpha=1.5), r"Conductor\.alpha: 1\.5 given"),
    (lambda: go.Conductor(alpha=(0.1, 0.2, 0.3)), "3 widths given, one or two expected"),
    (lambda: go.Conductor(alpha=float("nan")), "is not finite"),
    (lambda: go.Conductor(alpha="rough"), "'rough' given, a number or an array expected"),
    (lambda: go.Conductor(ndf="gxg"), r"(?s)Conductor\.ndf: unknown ndf 'gxg'.*did you mean 'ggx'"),
    (lambda: go.Conductor(masking="smith-corelated"), "did you mean 'smith-correlated'"),
    (lambda: go.Conductor(fresnel="shlick"), "did you mean 'schlick'"),
    (lambda: go.Dielectric(eta=0.0), r"Dielectric\.eta: 0 given"),
    (lambda: go.Dielectric(eta=9.0), r"Dielectric\.eta: 9 given"),
    (lambda: go.Dielectric(transmission="yes"), "'yes' given, True or False expected"),
    (lambda: go.Lambert(-0.5), r"Lambert\.albedo: -0\.5 given"),
    (lambda: go.Lambert([[0.1, 0.2, np.inf]]), "is not finite"),
    (lambda: go.OrenNayar(0.5, -1.0), r"OrenNayar\.sigma: -1 given"),
    (lambda: go.Phong(p=-3.0), r"Phong\.p: -3 given"),
    (lambda: go.mix(go.Lambert(), 3.0), "float given, a material expected"),
    (lambda: go.mix(go.Lambert(), go.Mirror(), 1.5), r"Mix\.weight: 1\.5 given"),
    (lambda: go.model("conductr"), r"(?s)unknown material 'conductr'.*did you mean 'conductor'"),
])  # fmt: skip
def test_values_that_cannot_be_are_one_clear_error(make: Any, text: str) -> None:
    with pytest.raises(go.InputError, match=text):
        make()


@pytest.mark.parametrize("shape", [(2,), (4, 2), (0,)])
def test_colours_of_no_three_channels_are_an_error(shape: tuple[int, ...]) -> None:
    with pytest.raises(go.InputError):
        go.Lambert(np.full(shape, 0.5)).eval(WO, WI)


def test_values_per_ray_of_another_count_are_an_error() -> None:
    with pytest.raises(go.InputError, match="rows"):
        go.Conductor(alpha=np.full(N + 2, 0.3)).eval(WO, WI)


def test_albedo_over_one_warns_and_one_does_not() -> None:
    with pytest.warns(go.GonioWarning):
        go.Mirror(1.01)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        go.Mirror(1.0)


def test_materials_are_frozen() -> None:
    with pytest.raises(dataclasses.FrozenInstanceError):
        go.Lambert().albedo = 0.3  # type: ignore[misc]


def test_names_are_flat_and_listed() -> None:
    names = list(go.models())
    assert names == sorted(names)
    assert {
        "lambert",
        "phong",
        "blinn-phong",
        "oren-nayar",
        "mirror",
        "conductor",
        "dielectric",
        "mix",
        "two-sided",
    } <= set(names)
    assert go.model("Blinn_Phong") is go.model("BlinnPhong") is go.BlinnPhong
    assert "Conductor" in dir(go) and "mix" in dir(go)
    with pytest.raises(AttributeError, match="no attribute 'Condutcor'"):
        go.Condutcor  # noqa: B018


@pytest.mark.parametrize("name", sorted(go.models()))
def test_every_parameter_is_documented_and_its_range_admits_its_default(name: str) -> None:
    cls = go.models()[name]
    assert cls.__doc__ and cls.parameters()
    for parameter in cls.parameters().values():
        assert parameter.doc and parameter.range
        if not parameter.required:
            parameter.check(parameter.default, name)


# ------------------------------------------------------------------------------- materials of one's own


class Velvet(go.BSDF):
    """Only eval is written: albedo sin^2 of the angle to the light."""

    from gonio.material import spectrum

    albedo: Any = spectrum(0.5, "colour", high=1.0)

    def eval(self, wo: Any, wi: Any, mode: str = "radiance") -> Any:
        """albedo (x^2 + y^2) z above the surface."""
        from gonio import ops

        above = (wo.z > 0.0) & (wi.z > 0.0)
        return self.albedo * ops.where(above, (ops.sqr(wi.x) + ops.sqr(wi.y)) * wi.z, 0.0)


@pytest.mark.parametrize("material", {**ALL, **COMPOSED}.values(), ids={**ALL, **COMPOSED})
def test_every_declared_breach_has_a_size_and_a_reason(material: go.BSDF) -> None:
    for law, breach in material.violations().items():
        assert breach.reason and breach.size > 0.0, law  # infinite where there is no bound


def test_material_with_eval_alone_can_be_sampled() -> None:
    velvet = Velvet((0.2, 0.4, 0.8))
    assert velvet.name == "velvet"
    u = random_numbers(100_000, 93)
    s = velvet.sample(np.tile(at(30), (len(u), 1)), u, precision="float64")
    # int sin^2 cos^2-free: 0.2 * 2 pi int (1 - z^2) z dz = 0.2 pi / 2
    assert s.weight[:, 0].mean() == pytest.approx(0.2 * np.pi / 2, rel=0.01)
    np.testing.assert_allclose(velvet.pdf(at(30), s.wi, precision="float64"), s.pdf, rtol=1e-12)
    assert velvet.record("sample").entry.name == "Velvet_sample"
    assert velvet.f(at(30), at(60)).shape == (1, 3)


def test_material_without_eval_says_so() -> None:
    class Empty(go.BSDF):
        pass

    with pytest.raises(NotImplementedError, match="Empty has no eval"):
        Empty().sample(WO, U)


def test_material_inside_a_material_may_be_ones_own() -> None:
    mixed = go.mix(Velvet(0.4), go.Lambert(0.2), 0.5).eval(WO, WI, precision="float64")
    expected = 0.5 * (Velvet(0.4).eval(WO, WI, precision="float64") + go.Lambert(0.2).eval(WO, WI, precision="float64"))
    np.testing.assert_allclose(mixed, expected, rtol=1e-13)


def test_directions_go_by_name_too() -> None:
    m = go.Conductor(alpha=0.3)
    np.testing.assert_array_equal(m.eval(wi=WI, wo=WO), m.eval(WO, WI))
    np.testing.assert_array_equal(m.pdf(WO, wi=WI), m.pdf(WO, WI))
    np.testing.assert_array_equal(m.sample(WO, u=U).wi, m.sample(WO, U).wi)
    with pytest.raises(TypeError, match=r"Conductor.eval lacks its argument 'wi'"):
        m.eval(WO)  # type: ignore[call-overload]
    with pytest.raises(TypeError, match=r"Conductor.eval has no argument 'wr'"):
        m.eval(WO, wr=WI)  # type: ignore[call-overload]


def test_a_tree_of_materials_has_a_bound() -> None:
    m: go.BSDF = go.Lambert(0.5)
    with pytest.raises(InputError, match="nested materials, at most 64 expected"):
        for _ in range(300):
            m = go.mix(m, go.Lambert(0.2), 0.5)


def test_compensation_is_measured_once_and_not_around_itself() -> None:
    once = go.KullaConty(go.mix(go.Conductor(alpha=0.3), go.Lambert(0.5), 0.5))
    with pytest.raises(InputError, match="cannot be nested"):
        go.KullaConty(go.KullaConty(once))


def test_a_part_of_a_model_does_not_take_its_bases_name() -> None:
    class _Facets(go.Conductor):
        pass

    assert _Facets.name == "" and go.model("conductor") is go.Conductor


@pytest.mark.parametrize(("written", "missing"), [("pdf", "sample"), ("sample", "pdf")])
def test_one_of_pdf_and_sample_alone_is_an_error_that_names_the_other(written: str, missing: str) -> None:
    methods = {"eval": go.Lambert.eval, written: getattr(go.Lambert, written)}
    with pytest.raises(InputError, match=f"Half has `{written}` and no `{missing}`") as error:
        type("Half", (go.BSDF,), methods)
    assert "lambert.py, line " in str(error.value) and f"write `{missing}` too, or neither" in str(error.value)
    type("_Half", (go.BSDF,), methods)  # a part of materials, which may write the rest


def test_names_of_the_last_release_go_on_working_with_a_warning_that_names_the_new_one() -> None:
    members = {"breaks": {"energy": go.KnownViolation("by nature", 1.0)}, "lossless": 1e-3, "gives_way": True}
    with pytest.warns(DeprecationWarning) as warned:
        cls = type("Former", (go.Lambert,), {**members, "leans": property(lambda self: True), "white": lambda self: 7})
    said = {str(one.message) for one in warned}
    assert {"Former.breaks is now known_violations", "Former.lossless is now lossless_tolerance"} <= said
    assert (cls.lossless_tolerance, cls.overridable, cls().perturbs_normal, cls().lossless()) == (1e-3, True, True, 7)
    assert cls().violations()["energy"].size == 1.0
    with pytest.warns(DeprecationWarning, match="Lambert.white is now lossless"):
        assert go.Lambert(0.5).white() == go.Lambert(1.0)
    with pytest.warns(DeprecationWarning, match="Lambert.breaks is now known_violations"):
        assert go.Lambert.breaks == {}
    with pytest.warns(DeprecationWarning, match="Breach is now KnownViolation"):
        assert go.Breach is go.KnownViolation
