"""The cost of the law of positivity: one set of kernels serves all parameter values."""

from __future__ import annotations

import gonio as go
from gonio.ops import backend
from gonio.verify.effort import EFFORTS, ELSEWHERE, Effort
from gonio.verify.laws import laws
from gonio.verify.subject import Subject, of

dr = backend.drjit()


def kernels(subject: Subject, effort: Effort) -> set[str]:
    """The kernels of more than a few operations that a judgment uses."""
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        laws()["positivity"].judge(subject, effort, 1)
        return {k["hash"] for k in dr.kernel_history([dr.KernelType.JIT]) if k["operation_count"] > 100}


def test_other_parameter_values_need_no_other_kernels() -> None:
    given = of(go.model("disney")())
    other = given.replace(clearcoat=0.5, sheen=0.3, roughness=0.2)
    assert kernels(other, ELSEWHERE["quick"]) <= kernels(given, EFFORTS["quick"])
