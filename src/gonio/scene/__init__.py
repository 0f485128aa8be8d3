"""Scenes in the lab's JSON format, with Gonio's additions: reading, validation, and construction of a Mitsuba scene.

from gonio import scene
from gonio.bridge import engine

description = scene.read("examples/phong")
mitsuba_scene = scene.build(description, engine.load())
"""

from __future__ import annotations

from .ball import of_material
from .build import build, built
from .reader import read, sources
from .schema import SceneDescription, json_schema

__all__ = ["SceneDescription", "build", "built", "json_schema", "of_material", "read", "sources"]
