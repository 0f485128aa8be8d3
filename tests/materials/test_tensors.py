"""Tensors of PyTorch and arrays of JAX as arguments: the values of NumPy's arrays, and gradients of reverse mode."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import gonio as go
import numpy as np
import pytest

GOLD = go.Conductor.preset("Au", alpha=0.3)


def directions(count: int = 64) -> tuple[np.ndarray, np.ndarray]:
    w = np.random.default_rng(3).normal(size=(2, count, 3))
    w[..., 2] = np.abs(w[..., 2]) + 0.1
    w /= np.linalg.norm(w, axis=-1, keepdims=True)
    return w[0], w[1]


WO, WI = directions()


def slope(path: str) -> np.ndarray:
    """The derivative of the summed values by a parameter, in forward mode."""
    return GOLD.eval(WO, WI, derivatives=[path], precision="float64")[1].sum()


@pytest.fixture
def torch() -> Any:
    return pytest.importorskip("torch", reason="PyTorch is not installed: tensors are not tested")


@pytest.fixture
def jax() -> Any:
    found = pytest.importorskip("jax", reason="JAX is not installed: its arrays are not tested")
    found.config.update("jax_enable_x64", True)
    return found


def test_numpy_loads_neither_library() -> None:
    code = "import sys, gonio as go; go.Lambert().eval([0,0,1], [0,0,1]); print({'torch', 'jax'} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"


def test_a_tensor_gives_a_tensor_with_the_values_of_an_array(torch: Any) -> None:
    wo, wi = torch.tensor(WO), torch.tensor(WI)
    for name in ("eval", "pdf"):
        value = getattr(GOLD, name)(wo, wi)
        assert isinstance(value, torch.Tensor) and value.dtype == torch.float64 and value.device == wo.device
        np.testing.assert_array_equal(value.numpy(), getattr(GOLD, name)(WO, WI, precision="float64"))
    assert GOLD.eval(wo.float(), wi.float()).dtype == torch.float32
    assert GOLD.eval(wo.reshape(8, 8, 3), wi.reshape(8, 8, 3)).shape == (8, 8, 3)


def test_gradients_reach_parameters_given_as_tensors(torch: Any) -> None:
    alpha = torch.tensor(0.3, dtype=torch.float64, requires_grad=True)
    albedo = torch.tensor([1.0, 0.9, 0.8], dtype=torch.float64, requires_grad=True)
    value = GOLD.eval(torch.tensor(WO), torch.tensor(WI), parameters={"alpha": alpha, "albedo": albedo})
    value.sum().backward()
    plain = go.Conductor(GOLD.eta, GOLD.k, 0.3, albedo=(1.0, 0.9, 0.8))
    values, by_alpha = plain.eval(WO, WI, derivatives=["alpha"], precision="float64")
    np.testing.assert_array_equal(value.detach().numpy(), values)
    np.testing.assert_allclose(alpha.grad.numpy(), by_alpha.sum(), rtol=1e-10)
    np.testing.assert_allclose(albedo.grad.numpy(), values.sum(0) / [1.0, 0.9, 0.8], rtol=1e-10)


def test_gradients_reach_directions_and_rows(torch: Any) -> None:
    wo = torch.tensor(WO, requires_grad=True)
    widths = torch.full((len(WO),), 0.3, dtype=torch.float64, requires_grad=True)
    GOLD.eval(wo, torch.tensor(WI), parameters={"alpha": widths}).sum().backward()
    np.testing.assert_allclose(widths.grad.sum(), slope("alpha"), rtol=1e-10)
    step = 1e-6 * np.cross(WO, [0.6, 0.0, 0.8])  # along the sphere, to first order
    either = [GOLD.eval((WO + s) / np.linalg.norm(WO + s, axis=1, keepdims=True), WI, precision="float64").sum(1)
              for s in (step, -step)]  # fmt: skip
    np.testing.assert_allclose(np.sum(wo.grad.numpy() * step, axis=1), 0.5 * (either[0] - either[1]), rtol=1e-5)


def test_a_fit_by_an_optimizer_of_pytorch_finds_the_width(torch: Any) -> None:
    wo, wi = torch.tensor(WO), torch.tensor(WI)
    target = GOLD.eval(wo, wi)
    alpha = torch.tensor(0.4, dtype=torch.float64, requires_grad=True)
    optimizer = torch.optim.LBFGS([alpha], max_iter=30, line_search_fn="strong_wolfe")

    def loss() -> Any:
        optimizer.zero_grad()
        size = torch.mean((GOLD.eval(wo, wi, parameters={"alpha": alpha}) - target) ** 2)
        size.backward()
        return size

    optimizer.step(loss)
    assert abs(alpha.item() - 0.3) < 1e-6


def test_the_example_of_the_manual_runs(torch: Any) -> None:
    page = (Path(__file__).parents[2] / "docs/command-line.md").read_text(encoding="utf-8")
    (code,) = [block for block in re.findall(r"```python\n(.*?)```", page, re.DOTALL) if "import torch" in block]
    names: dict[str, Any] = {"gold": GOLD}
    exec(code, names)
    assert torch.isfinite(names["alpha"].grad) and names["wi"].grad.shape == (1, 3)


def test_arrays_of_jax_have_values_and_gradients_also_compiled(jax: Any) -> None:
    wo, wi = jax.numpy.asarray(WO), jax.numpy.asarray(WI)
    value = GOLD.eval(wo, wi)
    assert isinstance(value, jax.Array)
    np.testing.assert_array_equal(np.asarray(value), GOLD.eval(WO, WI, precision="float64"))

    def total(alpha: Any) -> Any:
        return GOLD.eval(wo, wi, parameters={"alpha": alpha}).sum()

    for gradient in (jax.grad(total), jax.jit(jax.grad(total))):
        np.testing.assert_allclose(gradient(jax.numpy.float64(0.3)), slope("alpha"), rtol=1e-10)


@pytest.mark.parametrize(
    ("more", "text"),
    [
        ({"parameters": {"width": 0.3}}, "'width' is not a number or color of Conductor"),
        ({"derivatives": ["alpha"]}, "tensors of PyTorch or JAX in eval with derivatives"),
    ],
)
def test_a_wrong_call_is_one_clear_error(torch: Any, more: dict[str, Any], text: str) -> None:
    with pytest.raises(go.InputError, match=text):
        GOLD.eval(torch.tensor(WO), torch.tensor(WI), **more)


def test_parameters_of_numpy_belong_to_the_material() -> None:
    with pytest.raises(go.InputError, match="parameters given without tensors"):
        GOLD.eval(WO, WI, parameters={"alpha": 0.2})


U = np.random.default_rng(5).random((len(WO), 3))


def test_f_of_tensors_is_that_of_arrays_and_0_at_the_horizon(torch: Any) -> None:
    level = torch.tensor([[1.0, 0.0, 0.0]], dtype=torch.float64, requires_grad=True)
    assert (GOLD.f(torch.tensor(WO[:1]), level) == 0.0).all()
    alpha = torch.tensor(0.3, dtype=torch.float64, requires_grad=True)
    value = GOLD.f(torch.tensor(WO), torch.tensor(WI), parameters={"alpha": alpha})
    np.testing.assert_allclose(value.detach().numpy(), GOLD.f(WO, WI, precision="float64"), rtol=1e-14)
    value.sum().backward()
    rows = GOLD.eval(WO, WI, derivatives=["alpha"], precision="float64")[1] / WI[:, 2:]
    np.testing.assert_allclose(alpha.grad.numpy(), rows.sum(), rtol=1e-10)


def test_f_of_arrays_has_any_shape() -> None:
    shaped = GOLD.f(WO.reshape(8, 8, 3), WI.reshape(8, 8, 3))
    np.testing.assert_array_equal(shaped.reshape(-1, 3), GOLD.f(WO, WI))


GLASS = go.Dielectric(eta=1.5, alpha=0.2)
DRAWN = ("wi", "weight", "pdf", "eta")


def total_of(drawn: Any) -> Any:
    """A number that depends on every result with derivatives."""
    return (drawn.wi[..., 0] + drawn.weight[..., 1] * drawn.pdf + drawn.eta).sum()


def change(material: go.BSDF, path: str, value: float, step: float = 1e-6) -> float:
    """The derivative of `total_of` by a parameter at fixed random numbers, by differences."""
    either = [
        total_of(go.material(material, **{path: value + s}).sample(WO, U, precision="float64")) for s in (step, -step)
    ]
    return float(either[0] - either[1]) / (2.0 * step)


@pytest.mark.parametrize(("material", "path", "value"), [(GOLD, "alpha", 0.3), (GLASS, "eta", 1.5)])
def test_samples_of_tensors_have_gradients_at_fixed_numbers(
    torch: Any, material: go.BSDF, path: str, value: float
) -> None:
    given = torch.tensor(value, dtype=torch.float64, requires_grad=True)
    drawn = material.sample(torch.tensor(WO), torch.tensor(U), parameters={path: given})
    plain = material.sample(WO, U, precision="float64")
    for name in (*DRAWN, "delta"):
        np.testing.assert_array_equal(getattr(drawn, name).detach().numpy(), getattr(plain, name))
    assert drawn.delta.dtype == torch.bool and not drawn.delta.requires_grad
    total_of(drawn).backward()
    np.testing.assert_allclose(given.grad.numpy(), change(material, path, value), rtol=1e-4)


def test_samples_of_jax_have_gradients_also_compiled(jax: Any) -> None:
    wo, u = jax.numpy.asarray(WO), jax.numpy.asarray(U)

    def total(alpha: Any) -> Any:
        return total_of(GOLD.sample(wo, u, parameters={"alpha": alpha}))

    for gradient in (jax.grad(total), jax.jit(jax.grad(total))):
        np.testing.assert_allclose(gradient(jax.numpy.float64(0.3)), change(GOLD, "alpha", 0.3), rtol=1e-4)
    assert GOLD.f(wo, jax.numpy.asarray(WI)).shape == WO.shape
