"""A model as the functions, structs and tables of a shader, independent of the language.

All methods are recorded into one graph, so that eval, pdf and sample share functions. Quantities that depend on the
parameters alone (`BSDF.derive`) become a separate function, whose result is an argument of the others: a shader
computes it once per draw call instead of once per pixel.
"""

from __future__ import annotations

import functools
import inspect
import re
from collections.abc import Iterator, Mapping, Sequence

from .. import ops
from ..errors import InputError, did_you_mean
from ..material import BSDF, binding, recording, tree
from ..ops import Direction, graph
from ..ops.table import Table
from .folding import folded
from .polyfills import POLYFILLS
from .simplify import routines
from .values import Record, Routine, Value, shape

FUNCTIONS = ("eval", "pdf", "sample", "terms")

# descriptions of the entry points
ENTRIES = {
    "derive": "quantities that depend on the parameters alone: call it once per draw call",
    "eval": "the BSDF times |cos theta_i|, RGB, 1/sr",
    "pdf": "density with which `sample` generates wi, 1/sr",
    "sample": "wi, its weight eval / pdf, its pdf; u: three random numbers in [0, 1)",
    "terms": "the factors of eval, for inspection",
}


class Struct:
    """An argument that consists of fields: the parameters of a model, or quantities derived from them."""

    def __init__(
        self,
        name: str,
        fields: list[tuple[str, str]],
        doc: str = "",
        docs: dict[str, str] | None = None,
        arrays: bool = False,
    ) -> None:
        self.record = Record(name, [(flat(path), type_) for path, type_ in fields], doc, docs, arrays)
        self.paths = [path for path, _ in fields]


class Routines:
    """The content from which the text of a shader is written.

    routines  in order of definition, callees first
    entries   name -> entry point, a routine that a program calls
    recorded  the recording of each routine
    bound     the material with symbols as parameters, if there is one
    tables    the tables that the routines read
    readings  for each table, by identity, the operations that read it: "lookup" or "fetch"
    arrays    whether numbered constants are written as arrays
    """

    bound: BSDF | None = None
    arrays: bool = True
    derives: str = ""  # name of the routine that computes derived values

    def __init__(self, graph_of_all: graph.Graph, single: bool, values: Mapping[str, object] | None = None) -> None:
        numbers = folded(graph_of_all, {f"self.{path}": one for path, one in values.items()}) if values else {}
        simplified = routines(graph_of_all, guarded=not single, folded=numbers)
        self.driver = simplified.pop()
        functions_of = dict(zip((r.name for r in simplified), graph_of_all.functions, strict=False))
        self.recorded = {r: functions_of[r.name] for r in simplified}
        self.entries: dict[str, Routine] = {}
        self._parameters: dict[tuple, Struct] = {}
        self._derived: dict[tuple, Struct] = {}
        self.routines = simplified
        self.tables: list[Table] = []
        self.readings: dict[int, set[str]] = {}

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
        """The struct of the quantities derived from a model's parameters; `value` is the model or the dict of
        quantities."""
        key = tuple(derived_list(value))
        return self._derived.get(key)

    @property
    def _with_derived(self) -> object:
        """An argument that contains the derived values of the whole model."""
        for method, routine in self.entries.items():
            if method != "derive":
                return self.recorded[routine].arguments["self"]
        return None

    @property
    def derived(self) -> Struct | None:
        """The struct that is an argument of the entry points in addition to the parameters."""
        return self.derived_of(self._with_derived) if "derive" in self.entries else None

    # ------------------------------------------------------------------ contents

    def _reachable(self, all_: list[Routine]) -> list[Routine]:
        wanted = set(self.entries.values())
        for routine in reversed(all_):  # callers come after callees
            if routine in wanted:
                wanted |= {v.static for v in routine.values() if v.op == "call"}
        for routine in all_:
            unnamed = routine.record is None and not routine.single
            if routine in wanted and unnamed and routine.name != self.derives:
                self._name_result(routine)
        return [routine for routine in all_ if routine in wanted]

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
        arrays = not hasattr(result, "_fields")  # the names of named fields are preserved
        routine.record = Record(name, fields, doc.partition("\n")[0], dict(listed(doc)), arrays)

    def _tables(self) -> list[Table]:
        tables: dict[int, Table] = {}
        self.readings = {}
        for routine in self.routines:
            for value in routine.values():
                if value.op == "texel":
                    table, _, how = value.static
                    tables.setdefault(id(table), table)
                    self.readings.setdefault(id(table), set()).add(how)
        return list(tables.values())


class Program(Routines):
    """The parts of a model's shader.

    entries   method -> its routine, including "derive" if there is something to derive
    structs   structs of parameters, derived values and results, in order of use
    without   paths of parameters that are switched off, on which the code depends
    single    whether the program is for a language of float32 values, which lacks some functions of `gonio.ops`
    values    values of the parameters, by path, if they are folded into the code; else None
    """

    bound: BSDF

    def __init__(
        self,
        model: BSDF,
        functions: tuple[str, ...],
        without: Sequence[str] = (),
        single: bool = True,
        arrays: bool = True,
        values: Mapping[str, object] | None = None,
    ) -> None:
        self.folds = values is not None
        self.model, self.without, self.arrays = model, tuple(without), arrays
        self.bound = recording.symbols(model, self.without)
        super().__init__(recorded(self.bound, functions, single), single, values)
        stem = graph.class_name(model)
        self.derives = f"{stem}_derive"
        for routine in self.routines:
            for method in (*functions, "derive"):
                if routine.name == f"{stem}_{method}":
                    self.entries[method] = routine
        self.routines = self._reachable(self.routines)
        self._trim_derived()
        self.tables = self._tables()

    def _trim_derived(self) -> None:
        """Create one struct for each structure of derived values, with the fields that are used."""
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
                doc = f"Quantities that depend on the parameters alone: {by} computes them, once per draw call."
                self._derived[key] = Struct(name, fields, doc, arrays=True)
        derive = self.entries.get("derive")
        if derive is None:
            return
        struct = self._derived.get(tuple(derived_list(self._with_derived)))
        if struct is None:  # none of the fields is used
            del self.entries["derive"]
            self.routines.remove(derive)
            return
        by_path = {place(f"derived.{path}")[1]: value for path, value in derive.results}
        derive.results = [(path, by_path[path]) for path in struct.paths]
        derive.used = {derive.parameters.index(v) for v in derive.values() if v.op == "parameter"}
        derive.record, derive.single = struct.record, False
        self.routines = self._reachable(self.routines)  # without routines that only unused fields require


def recorded(bound: BSDF, functions: tuple[str, ...], single: bool) -> graph.Graph:
    """A recording of functions of a material whose parameters are symbols; it returns their results in order.

    single  whether the recording is for a language of float32 values, which lacks some functions of `gonio.ops`
    """

    def every(self: BSDF, wo: Direction, wi: Direction, u: Direction) -> tuple[object, ...]:
        """Calls all functions in a recording; not part of the shader."""
        if any(inner.derives for _, inner in tree.walk(self)):
            self = settle(self, derive(self))
        return tuple(getattr(self, method)(wo, u if method == "sample" else wi) for method in functions)

    into = graph.Graph(POLYFILLS if single else {}, single=single)
    return ops.record(every, types={"wo": "vec3", "wi": "vec3", "u": "vec3"}, name="every", into=into, self=bound)


@ops.function
def derive(self: BSDF) -> dict[str, object]:
    """Quantities that depend only on the parameters; computed once, not for every pair of directions."""
    return _derive(self)


def _derive(material: BSDF) -> dict[str, object]:
    """The derived quantities of every material of the tree, by path."""
    return {path: inner.derive() for path, inner in tree.walk(material) if inner.derives}


def settle(material: BSDF, derived: dict[str, object], path: str = "") -> BSDF:
    """A copy of a bound material whose tree contains the result of `derive`."""
    below = {name: settle(inner, derived, tree.join(path, name)) for name, inner in tree.children(material).items()}
    return binding.bound_copy(material, below, derived.get(path))


# ---------------------------------------------------------------------- paths


@functools.cache
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
    """(path, type) of each numeric parameter of a model, including inner materials."""
    pairs = ((place("x" + path), node.type) for path, node in graph._flatten(value, ""))
    return [(rest, shape(type_)) for (_, rest, derived), type_ in pairs if not derived]


def derived_list(value: object) -> list[tuple[str, str]]:
    """(path, type) of each derived value of a model or a dict."""
    if not isinstance(value, BSDF | dict):
        return []
    pairs = ((place("x" + path), node.type) for path, node in graph._flatten(value, ""))
    return [(rest, shape(type_)) for (_, rest, derived), type_ in pairs if derived or isinstance(value, dict)]


def _result_name(path: str, value: Value) -> str:
    if path and not path[0].isdigit():
        return flat(path)
    return flat(value.name.rpartition(".")[2] or f"value_{path}")


def parameter_docs(model: BSDF) -> Iterator[tuple[str, str]]:
    """(field, description with unit and range) of each numeric parameter of a model."""
    for path, parameter, _, _ in tree.surface(model):
        if parameter.numeric:
            doc = parameter.doc.partition(";")[0] if parameter.kind == "alpha" else parameter.doc
            form = {"alpha": "along x, along y", "angle": "as (cos, sin)"}.get(parameter.kind, parameter.unit)
            range_ = parameter.range if parameter.range != "any number" else ""
            yield flat(path), "; ".join(part for part in (doc, form, range_) if part)


def listed(doc: str) -> Iterator[tuple[str, str]]:
    """(name, description) for each line "name  description" of a docstring; indented lines continue a description."""
    name, text = "", ""
    for line in doc.splitlines():
        entry = re.match(r"(\w+)  +(\S.*)", line)
        if name and (entry or not line.startswith("  ")):
            yield name, text
            name = ""
        if entry:
            name, text = entry[1], entry[2]
        elif name:
            text += " " + line.strip()
    if name:
        yield name, text


def check(model: object, functions: str | Sequence[str], location: str) -> tuple[str, ...]:
    """Return the requested functions without repetition, and without "terms" if the model has none.

    functions  names in a sequence, or in one string separated by commas
    location   the location that errors state
    Raises InputError for an unknown function, and for a model that cannot be written as shader code.
    """
    if not isinstance(model, BSDF):
        raise InputError(f"{type(model).__name__} given, a material expected", location)
    if isinstance(functions, str):
        functions = [name.strip() for name in functions.split(",") if name.strip()]
    try:
        asked = tuple(dict.fromkeys(str(name) for name in functions))
    except TypeError:
        raise InputError(f"{functions!r} given, names of functions expected", location, _KNOWN) from None
    for name in asked:
        if name not in FUNCTIONS:
            raise InputError(f"unknown function '{name}'", location, did_you_mean(name, FUNCTIONS))
    if not asked:
        raise InputError("no function given", location, _KNOWN)
    random = stochastic(model)
    if random is not None:
        what = f"{type(random).__name__} is estimated by random walks and cannot be written as shader code"
        raise InputError(what, location, "use KullaConty, which has a closed form")
    available = tuple(name for name in asked if name != "terms" or model.has_terms)
    if not available:
        raise InputError(f"{type(model).__name__} has no terms D, G, F", location, "give eval, pdf or sample")
    return available


_KNOWN = "known: " + ", ".join(FUNCTIONS)


def stochastic(model: BSDF) -> BSDF | None:
    """The material, this one or a nested one, whose values are random numbers; else None."""
    return next((inner for _, inner in tree.walk(model) if inner.stochastic), None)


def written_from(model: object) -> str:
    """A description of the source of a material's code: the Python source of the class, or the shader that was read."""
    shader = getattr(type(model), "program", None)
    return f"the shader {shader.where}" if shader else "its Python source"


def choices(model: BSDF) -> list[tuple[str, Value]]:
    """(path, value) of each choice on which the code depends: classes of materials, options and flags."""
    return [
        *((path, type(inner).__name__) for path, inner in tree.walk(model) if path),
        *((leaf.path, leaf.value) for leaf in tree.leaves(model) if not leaf.parameter.numeric),
    ]
