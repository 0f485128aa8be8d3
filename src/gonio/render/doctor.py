"""Check the rendering software of this machine: what is installed, what is missing, and how to install it.

If LLVM or a driver is incompatible, Dr.Jit aborts the process without an exception. Therefore every trial runs in a
separate process.
"""

from __future__ import annotations

import importlib.metadata
import os
import platform
import subprocess
import sys
from dataclasses import asdict, dataclass

from .. import llvm
from .._version import __version__
from ..bridge import engine
from ..errors import MachineError
from ..pictures import denoise
from ..spirv.compiler import INSTALL
from ..spirv.compiler import compiler as shader_compiler

# Traces rays with Embree or OptiX, evaluates a Gonio material and compiles a kernel: all that a render needs.
_TRIAL = """
from gonio.bridge import engine
mi = engine.load({device!r})
import drjit as dr
import gonio.mitsuba
scene = mi.load_dict({{"type": "scene", "ball": {{"type": "sphere", "bsdf": {{"type": "gonio_lambert"}}}}}})
ray = mi.Ray3f(mi.Point3f(0, 0, 5), dr.normalize(mi.Vector3f(dr.linspace(mi.Float, -0.1, 0.1, 64), 0, -1)))
si = scene.ray_intersect(ray)
value = si.bsdf().eval(mi.BSDFContext(), si, dr.normalize(mi.Vector3f(0.1, 0.1, 1)))
total = float(dr.sum(value[0])[0])
assert 5 < total < 25, total
print("variant", mi.variant())
print("threads", dr.thread_count())
"""
_TRIAL_SECONDS = 120  # the first start compiles for some seconds; if it exceeds this limit, the machine cannot render


@dataclass(frozen=True)
class Finding:
    """One line of the report; `state` is "ok", "missing" (optional) or "bad"."""

    state: str
    subject: str
    text: str


@dataclass(frozen=True)
class Report:
    """All findings, the result of the trial on each device, and whether this machine can render."""

    findings: tuple[Finding, ...]
    devices: dict[str, str]  # device -> "" if it works, otherwise the problem

    @property
    def can_render(self) -> bool:
        return "" in self.devices.values()

    @property
    def verdict(self) -> str:
        working = [device for device, problem in self.devices.items() if not problem]
        return "can render on: " + ", ".join(working) if working else "nothing to render with: see !! above"

    def as_dict(self) -> dict[str, object]:
        return {"can_render": self.can_render, **asdict(self)}


def examine() -> Report:
    """Examine this machine. This takes a few seconds, mostly for the trials."""
    findings = [
        Finding("ok", "Gonio", f"{__version__}, Python {platform.python_version()}, {platform.platform(terse=True)}"),
        _package("mitsuba", "Mitsuba", "pip install mitsuba"),
        _package("drjit", "Dr.Jit", "pip install drjit"),
        *_libraries(),
        Finding("ok", "threads", f"{os.cpu_count()} CPU cores"),
    ]
    devices = {}
    for device in ("cpu", "cuda"):
        problem, notes = _try(device)
        devices[device] = problem
        if not problem:
            findings.append(Finding("ok", f"render on {device}", f"a trial kernel ran ({notes})"))
        elif device == "cuda" and not engine.cuda_available():
            hint = "for --device cuda: an NVIDIA GPU and its driver"
            findings.append(Finding("missing", "render on cuda", f"no CUDA device answers; {hint}"))
        else:
            findings.append(Finding("bad", f"render on {device}", problem))
    pyoidn_version = denoise.available()
    if pyoidn_version:
        findings.append(Finding("ok", "denoiser", f"Open Image Denoise by pyoidn {pyoidn_version}"))
    else:
        findings.append(Finding("missing", "denoiser", f"for --denoise: {denoise.INSTALL}"))
    findings.append(_shader_compiler())
    return Report(tuple(findings), devices)


def _shader_compiler() -> Finding:
    try:
        return Finding("ok", "shader compiler", shader_compiler())
    except MachineError:
        return Finding("missing", "shader compiler", f"to read GLSL and HLSL: {INSTALL}")


def _package(name: str, subject: str, install: str) -> Finding:
    try:
        return Finding("ok", subject, importlib.metadata.version(name))
    except importlib.metadata.PackageNotFoundError:
        return Finding("bad", subject, f"not installed: {install}")


def _libraries() -> list[Finding]:
    """The findings on LLVM: every library that was found, which of them is used, and why others are not."""
    findings = []
    chosen = False
    for library in llvm.libraries():
        subject = f"LLVM {library.version or '?'}"
        place = f"{library.path} ({library.source})"
        if not library.usable:
            why = f"older than {llvm.OLDEST_USABLE}, it would abort the process" if library.version else "no libLLVM"
            findings.append(Finding("missing", subject, f"{place}: {why}; not used"))
        else:
            findings.append(Finding("ok", subject, place + (": spare" if chosen else ": used for --device cpu")))
            chosen = True
    if not any(finding.state == "ok" for finding in findings):
        hint = f"pip install karellen-llvm-core (Linux x86-64), or any LLVM >= {llvm.OLDEST_USABLE} of the system"
        findings.append(Finding("bad", "LLVM", f"none that can be used; {hint}"))
    return findings


def _try(device: str) -> tuple[str, str]:
    """Run the trial on a device in a separate process. Returns the problem, or "" if there is none, and the output.

    The option -P prevents Python from importing modules, such as a numpy.py, from the current folder.
    """
    command = [sys.executable, "-P", "-c", _TRIAL.format(device=device)]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=_TRIAL_SECONDS)
    except subprocess.TimeoutExpired:
        return f"the trial did not end within {_TRIAL_SECONDS} s", ""
    except OSError as error:
        return f"the trial could not start: {error}", ""
    if done.returncode == 0:
        return "", ", ".join(done.stdout.split("\n")).strip(", ")
    if done.returncode < 0:
        return f"the trial was ended by signal {-done.returncode}: this LLVM or driver does not fit", ""
    lines = [line for line in done.stderr.strip().splitlines() if line.strip()]
    told = [line for line in lines if "Error: " in line]
    text = " ".join(line.strip() for line in lines[lines.index(told[-1]) :]) if told else (lines or ["no reason"])[-1]
    return text.removeprefix("gonio.errors.MachineError: "), ""
