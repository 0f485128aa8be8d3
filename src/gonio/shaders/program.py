"""A model as the functions, structs and tables of a shader, in no language yet.

All methods are recorded into one graph, so that what eval, pdf and sample share is there once. What follows from the
parameters alone (`BSDF.derive`) becomes a function of its own, whose result the others take as an argument: a shader
computes it once a draw, not once a pixel.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator, Sequence

from .. import ops
from ..errors import InputError, did_you_mean
from ..material import BSDF, binding, recording, tree
from ..ops import Direction, graph
from ..ops.table import Table
from .polyfills import POLYFILLS
from .simplify import Record, Routine, Value, routines, shape

FUNCTIONS = ("eval", "pdf", "sample", "terms")


class Struct:
    """An argument made of fields: a model's parameters, or what was derived from them."""

    def __init__(
        self, name: str, fields: list[tuple[str, str]], doc: str = "", docs: dict[str, str] | None = None
    ) -> None:
        self.record = Record(name, [(flat(path), type_) for path, type_ in fields], doc, docs)
        self.paths = [path for path, _ in fields]


class Program:
    """What a shader of one model is made of.

    routines  in order of definition, callees first
    entries   method -> its routine, "derive" among them where there is something to derive
    structs   of parameters, derived values and results, in order of use
    without   paths of parameters that are off and shape the code
    tables    the tables that are read
    readings  of each, by identity, how: "lookup" and "fetch"
    """

    def __init__(self, model: BSDF, functions: tuple[str, ...], without: Sequence[str] = ()) -> None:
        self.model, self.without = model, tuple(without)
        self.bound = recording.symbols(model, self.without)
        recorded = _record(self.bound, functions)
        found = routines(recorded)
        self.driver = found.pop()
        functions_of = dict(zip((r.name for r in found), recorded.functions, strict=False))
        self.recorded = {r: functions_of[r.name] for r in found}
        self.entries: dict[str, Routine] = {}
        stem = graph.class_name(model)
        for routine in found:
            for method in (*functions, "derive"):
                if routine.name == f"{stem}_{method}":
                    self.entries[method] = routine
        self._parameters: dict[tuple, Struct] = {}
        self._derived: dict[tuple, Struct] = {}
        self.routines = self._reachable(found)
        self._trim_derived()
        self.tables = self._tables()

    # ------------------------------------------------------------------ structs

    def struct_of(self, value: object) -> Struct | None:
        """The struct of a model's parameters."""
        if not isinstance(value, BSDF):
            return None
        fields = tuple(field_list(value))
        key = (type(value).__name__, fields)
        if key not in self._parameters:
            name = graph.first_free(graph.class_name(value), [s.record.name for s in self._parameters.values()])
            doc = (type(value).__doc__ or "").strip().splitlines()[0]
            self._parameters[key] = Struct(name, list(fields), doc, dict(parameter_docs(value)))
        return self._parameters[key]

    def derived_of(self, value: object) -> Struct | None:
        """The struct of what is derived from a model's parameters; also of the dict itself."""
        key = tuple(derived_list(value))
        return self._derived.get(key)

    def _trim_derived(self) -> None:
        """One struct for each structure of derived values, with the fields that somebody uses."""
        used: dict[tuple, set[str]] = {}
        owner: dict[tuple, str] = {}
        for routine in self.routines:
            for argument, value in self.recorded[routine].arguments.items():
                key = tuple(derived_list(value))
                if not key:
                    continue
                if isinstance(value, BSDF):
                    owner.setdefault(key, graph.class_name(value))
                used.setdefault(key, set())
                for index in routine.used:
                    root, path, derived = place(routine.parameters[index].static)
                    if root == argument and (derived or not isinstance(value, BSDF)):
                        used[key].add(path)
        for key, paths in used.items():
            fields = [(path, type_) for path, type_ in key if path in paths]
            if fields and key in owner:
                name = graph.first_free(f"{owner[key]}Derived", [s.record.name for s in self._derived.values()])
                by = f"{graph.class_name(self.model)}_derive"
                doc = f"What follows from the parameters alone: {by} computes it, once a draw."
                self._derived[key] = Struct(name, fields, doc)
        derive = self.entries.get("derive")
        if derive is None:
            return
        struct = self._derived.get(tuple(derived_list(self._settled)))
        if struct is None:  # nothing of it is used
            del self.entries["derive"]
            self.routines.remove(derive)
            return
        kept = {place(f"derived.{path}")[1]: value for path, value in derive.results}
        derive.results = [(path, kept[path]) for path in struct.paths]
        derive.used = {derive.parameters.index(v) for v in derive.values() if v.op == "parameter"}
        derive.record, derive.single = struct.record, False
        self.routines = self._reachable(self.routines)  # without what served only fields that nobody uses

    @property
    def _settled(self) -> object:
        """An argument that has the derived values of the whole model."""
        for method, routine in self.entries.items():
            if method != "derive":
                return self.recorded[routine].arguments["self"]
        return None

    @property
    def derived(self) -> Struct | None:
        """The struct that the entries take besides the parameters."""
        return self.derived_of(self._settled) if "derive" in self.entries else None

    # ------------------------------------------------------------------ what is there

    def _reachable(self, found: list[Routine]) -> list[Routine]:
        wanted = set(self.entries.values())
        for routine in reversed(found):  # callers come after callees
            if routine in wanted:
                wanted |= {v.static for v in routine.values() if v.op == "call"}
        for routine in found:
            unnamed = routine.record is None and not routine.single
            if routine in wanted and unnamed and routine.name != f"{graph.class_name(self.model)}_derive":
                self._name_result(routine)
        return [routine for routine in found if routine in wanted]

    def _name_result(self, routine: Routine) -> None:
        result = self.recorded[routine].result
        if routine.name.endswith("_terms"):
            name = routine.name.removesuffix("_terms") + "Terms"
        elif hasattr(result, "_fields"):
            name = type(result).__name__
        else:
            name = "".join(part[:1].upper() + part[1:] for part in routine.name.split("_")) + "Result"
        fields = [(_result_name(path, value), value.type) for path, value in routine.results]
        doc = inspect.getdoc(type(result)) or "" if hasattr(result, "_fields") else ""
        routine.record = Record(name, fields, doc.partition("\n")[0], dict(listed(doc)))

    def _tables(self) -> list[Table]:
        found: dict[int, Table] = {}
        self.readings: dict[int, set[str]] = {}
        for routine in self.routines:
            for value in routine.values():
                if value.op == "texel":
                    table, _, how = value.static
                    found.setdefault(id(table), table)
                    self.readings.setdefault(id(table), set()).add(how)
        return list(found.values())


def _record(bound: BSDF, functions: tuple[str, ...]) -> graph.Graph:
    def every(self: BSDF, wo: Direction, wi: Direction, u: Direction) -> tuple[object, ...]:
        """The driver of a recording; no part of the shader."""
        if any(inner.derives for _, inner in tree.walk(self)):
            self = settle(self, derive(self))
        return tuple(getattr(self, method)(wo, u if method == "sample" else wi) for method in functions)

    into = graph.Graph(POLYFILLS, single=True)
    return ops.record(every, types={"wo": "vec3", "wi": "vec3", "u": "vec3"}, name="every", into=into, self=bound)


@ops.function
def derive(self: BSDF) -> dict[str, object]:
    """What follows from the parameters alone: to be computed once, not for every pair of directions."""
    return _derive(self)


def _derive(material: BSDF) -> dict[str, object]:
    """What every material of the tree derives, by its path."""
    return {path: inner.derive() for path, inner in tree.walk(material) if inner.derives}


def settle(material: BSDF, derived: dict[str, object], path: str = "") -> BSDF:
    """A copy of a bound material whose tree holds what `derive` gave."""
    below = {name: settle(inner, derived, tree.join(path, name)) for name, inner in tree.children(material).items()}
    return binding.bound_copy(material, below, derived.get(path))


# ---------------------------------------------------------------------- paths


def place(path: str) -> tuple[str, str, bool]:
    """(root argument, path below it, whether it is a derived value) of a parameter of a recording."""
    root, _, rest = path.partition(".")
    parts = rest.split(".") if rest else []
    derived = binding.DERIVED in parts
    return root, ".".join(part for part in parts if part not in (binding.DERIVED, "")), derived


def flat(path: str) -> str:
    """A field's name in a struct."""
    return path.replace(".", "_")


def field_list(value: object) -> list[tuple[str, str]]:
    """(path, type) of a model's numeric parameters, those of inner materials included."""
    pairs = ((place("x" + path), node.type) for path, node in graph._flatten(value, ""))
    return [(rest, shape(type_)) for (_, rest, derived), type_ in pairs if not derived]


def derived_list(value: object) -> list[tuple[str, str]]:
    """(path, type) of derived values: of those that a model holds, or of a dict of them."""
    if not isinstance(value, BSDF | dict):
        return []
    pairs = ((place("x" + path), node.type) for path, node in graph._flatten(value, ""))
    return [(rest, shape(type_)) for (_, rest, derived), type_ in pairs if derived or isinstance(value, dict)]


def _result_name(path: str, value: Value) -> str:
    if path and not path[0].isdigit():
        return flat(path)
    return value.name.rpartition(".")[2] or f"value_{path}"


def parameter_docs(model: BSDF) -> Iterator[tuple[str, str]]:
    """(field, what it is, with unit and range) of a model's numeric parameters."""
    for path, parameter, _, _ in tree.surface(model):
        if parameter.numeric:
            doc = parameter.doc.partition(";")[0] if parameter.kind == "alpha" else parameter.doc
            form = {"alpha": "along x, along y", "angle": "as (cos, sin)"}.get(parameter.kind, parameter.unit)
            range_ = parameter.range if parameter.range != "any number" else ""
            yield flat(path), "; ".join(part for part in (doc, form, range_) if part)


def listed(doc: str) -> Iterator[tuple[str, str]]:
    """(name, what is said of it) in a docstring's list, "name  what it is" a line, continued by indented lines."""
    name, said = "", ""
    for line in doc.splitlines():
        found = re.match(r"(\w+)  +(\S.*)", line)
        if name and (found or not line.startswith("  ")):
            yield name, said
            name = ""
        if found:
            name, said = found[1], found[2]
        elif name:
            said += " " + line.strip()
    if name:
        yield name, said


def check(model: object, functions: str | Sequence[str], where: str) -> tuple[str, ...]:
    """The functions asked for that the model has, each once; InputError where there can be no shader code.

    functions  names in a sequence, or in one string with commas between them
    """
    if not isinstance(model, BSDF):
        raise InputError(f"{type(model).__name__} given, a material expected", where)
    if isinstance(functions, str):
        functions = [name.strip() for name in functions.split(",") if name.strip()]
    try:
        asked = tuple(dict.fromkeys(str(name) for name in functions))
    except TypeError:
        raise InputError(f"{functions!r} given, names of functions expected", where, _KNOWN) from None
    for name in asked:
        if name not in FUNCTIONS:
            raise InputError(f"unknown function '{name}'", where, did_you_mean(name, FUNCTIONS))
    if not asked:
        raise InputError("no function named", where, _KNOWN)
    random = stochastic(model)
    if random is not None:
        what = f"{type(random).__name__} is estimated by random walks and cannot be written as shader code"
        raise InputError(what, where, "KullaConty is its closed form")
    found = tuple(name for name in asked if name != "terms" or model.has_terms)
    if not found:
        raise InputError(f"{type(model).__name__} has no terms D, G, F", where, "name eval, pdf or sample")
    return found


_KNOWN = "known: " + ", ".join(FUNCTIONS)


def stochastic(model: BSDF) -> BSDF | None:
    """The material, this or one inside, whose values are random numbers; else None."""
    return next((inner for _, inner in tree.walk(model) if inner.stochastic), None)
