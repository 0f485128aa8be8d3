"""Load Mitsuba XML files of scenes and single BSDFs, with the same checks as for the lab's scenes."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from types import ModuleType

from ..bridge import foreign, plugin_search
from ..bridge.faults.exr_threads import file_threads
from ..bridge.native import MitsubaBSDF
from ..bridge.types import Plugin, PluginDict, Scene
from ..errors import GonioError, InputError, in_user_code, summary
from . import mitsuba_xml
from .mitsuba_xml import SceneText


def read(
    file: Path, parameters: Mapping[str, object], allow_outside: bool = False, allow_code: bool = False
) -> SceneText:
    """Read a Mitsuba XML file, see `mitsuba_xml.read`.

    parameters     values of the `$parameters`: strings, numbers or lists of numbers
    allow_outside  whether the scene may name files outside its folder
    allow_code     whether the scene may load native plugins from the folder `plugins` next to it
    """
    values = {key: _as_xml(value) for key, value in parameters.items()}
    return mitsuba_xml.read(file, values, allow_outside, allow_code)


def load(
    mi: ModuleType,
    file: Path,
    text: SceneText,
    *,
    size: tuple[int, int] | None = None,
    own_integrator: bool = True,
) -> Scene:
    """Load the scene of a Mitsuba XML file, given its text as returned by `read`.

    size            size of the film in pixels; None uses that of the scene
    own_integrator  whether the scene must name an integrator
    Raises InputError if Mitsuba rejects the scene.
    """
    location = str(file)
    try:
        scene = instantiated(text, file.parent, mi)
        if not isinstance(scene, mi.Scene):
            raise InputError("this file holds no <scene>", location, "give a Mitsuba scene, a folder or a .json")
        if not scene.sensors():
            raise InputError("the scene has no <sensor>", location, "add one: it holds the camera and the film")
        if scene.integrator() is None and own_integrator:
            raise InputError("the scene has no <integrator>", location, "add one, or give --integrator path")
        if size is not None:
            film = mi.traverse(scene.sensors()[0])
            film["film.size"] = list(size)
            film.update()
    except InputError:
        raise
    except (RuntimeError, ValueError, TypeError, KeyError) as error:
        what = _mitsuba_text(error, text)
        raise InputError(what, location, "correct it there; the texts are Mitsuba's") from error
    return scene


@contextlib.contextmanager
def rendering(file: Path, own_integrator: bool) -> Iterator[None]:
    """Convert errors that a scene causes during rendering to InputErrors with Mitsuba's text.

    own_integrator  whether the scene is rendered by its own integrator. If so, every error that was not raised by one
                    of Gonio's materials is attributed to Mitsuba; otherwise, only errors raised by plugins are, such as
                    "[Texture] eval_1_grad(): not implemented!"
    """
    try:
        yield
    except (GonioError, MemoryError):
        raise
    except Exception as error:
        cause: BaseException = error
        while (inner := cause.__cause__ or cause.__context__) is not None:
            cause = inner
        ours = isinstance(cause, GonioError) or in_user_code(error) is not None
        text = re.sub(r"\[\w+\.(cpp|h):\d+\] ", "", summary(cause).partition(": ")[2])
        if ours or not (own_integrator or text.startswith("[")):
            raise
        raise InputError(f"Mitsuba cannot render it: {text}", str(file), "correct the scene") from error


def load_bsdf(path: Path) -> MitsubaBSDF:
    """Load the BSDF of a Mitsuba XML file, which is the root element or the first BSDF of a scene.

    The file may refer to other files in the same folder. Raises InputError if there is no BSDF.
    """
    mi = foreign.mitsuba()
    with _without_options():
        text = mitsuba_xml.read(path, {})
    try:
        loaded = instantiated(text, path.parent, mi)
    except Exception as error:
        raise foreign.rejected(error, path.name) from None
    if isinstance(loaded, mi.BSDF):
        return MitsubaBSDF(loaded)
    if isinstance(loaded, mi.Scene):
        for shape in loaded.shapes():
            if shape.bsdf() is not None:
                return MitsubaBSDF(shape.bsdf())
    raise InputError("no BSDF in this file", str(path), "give a file whose root is <bsdf>, or a scene with one")


def within(description: PluginDict, file: Path) -> PluginDict:
    """A description from a file, in which the names of other files are replaced by absolute paths.

    These files must be in the folder of the file.
    """

    def locate(name: str) -> str:
        return mitsuba_xml.readable(name, file.parent / name, file.parent, str(file))

    placed: PluginDict = {}
    for name, value in description.items():
        if isinstance(value, dict):
            value = within(value, file)
        elif isinstance(value, str):
            with _without_options():
                value = mitsuba_xml.property_value(str(description.get("type")), name, value, str(file), locate)
        placed[name] = value
    return placed


@contextlib.contextmanager
def _without_options() -> Iterator[None]:
    """Inside the `with` block, remove the hint about `--allow-outside`, an option for scenes, from errors."""
    try:
        yield
    except InputError as error:
        raise InputError(error.what, error.where, error.hint.replace(", or use --allow-outside", "")) from None


def instantiated(text: SceneText, folder: Path, mi: ModuleType) -> Plugin:
    """The Mitsuba object that the text of a scene describes. Raises Mitsuba's own errors."""
    allowed = [folder.resolve()] if text.runs_code else []
    # Objects are loaded sequentially and without merging; otherwise the order of the shapes, and thus the last bits of
    # the picture, would be random. In addition, an unreadable file would abort the process if it were loaded in
    # parallel, because the error would be raised in another thread.
    with file_threads(), plugin_search.searching(mi, *allowed):
        return mi.load_string(text.text, parallel=False, optimize=False)


def _as_xml(value: object) -> str:
    return ", ".join(map(str, value)) if isinstance(value, list) else str(value)


def _mitsuba_text(error: Exception, scene: SceneText) -> str:
    """Mitsuba's message, without locations in its C++ source and without a traceback of Gonio."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    ours = [line for line in lines if re.match(r"\w*(Error|Exception): ", line)]
    text = lines[0] if lines else type(error).__name__
    if ours:  # an error of a Gonio material, raised inside Mitsuba's parser
        text = text.removesuffix("Traceback (most recent call last):")
        text += ours[-1].split(": ", 1)[1] if text != lines[0] else ""
    elif len(lines) > 1:
        text += " " + "; ".join(lines[1:4])
    return scene.located(re.sub(r"\[\w+\.(cpp|h):\d+\] ", "", text))


def sources(text: SceneText, parameters: Mapping[str, object]) -> tuple[Callable[[], str], dict[str, Path]]:
    """A function that returns the text of a scene with all includes, and the files of the scene by their names."""
    given = repr(sorted((key, _as_xml(value)) for key, value in parameters.items()))
    return lambda: "\n".join([given, *text.sources]), text.files
