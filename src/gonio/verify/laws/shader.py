"""Shader parity: tested by the project's own tests, in a browser that can run a shader."""

from __future__ import annotations

from ..effort import Effort
from ..subject import Subject
from ..verdict import DoesNotApply, Finding
from .base import Law


class Shader(Law):
    """The shader code of a model gives the model's values."""

    number = 12
    on_request = True
    name = "shader"
    title = "shader code gives the same values"
    meaning = "The picture of a real-time engine differs from the offline reference."

    def judge(self, subject: Subject, effort: Effort, seed: int) -> Finding:
        raise DoesNotApply("it needs a browser to run a shader; the project's tests do it for every model")
