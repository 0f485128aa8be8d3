"""Execution of a module's functions with the operations of `gonio.ops`.

All lanes run together: each block runs under the mask of the lanes that reach it, which selects stores and results. A
loop runs until no lane is left in it; its counter is a plain number, so the loop is unrolled. Rejected are loops whose
end depends only on values that are not constant, and discard, atomics, barriers and whatever has no meaning for a BSDF.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ..errors import InputError
from ..ops import graph
from . import calls, composites
from .arithmetic import COMPARED, FLOATS, INTEGERS, LOGIC, WHOLE, elementwise, passing
from .bits import cast
from .composites import Cell, Pointer
from .flow import Flow, flow_of
from .images import Texture, sampled
from .inputs import initial
from .messages import ALONE
from .module import BUFFERS, UNIFORM, Block, Function, Instruction, Module
from .opcodes import REFUSED
from .standard import ELEMENTWISE, GEOMETRIC, MODF, REFUSED_FUNCTIONS, WHOLE_NUMBERS, parts
from .values import (
    UNDEFINED,
    Undefined,
    Value,
    both,
    either,
    leaves,
    lost,
    negated,
    refuse,
    select,
    static,
    truth,
    wrapped,
)
from .work import Work

MAX_ITERATIONS = 4096  # iterations of a loop with a constant counter, each time it is entered
MAX_VARYING = 256  # iterations of a loop without a constant bound, after which it is rejected
MAX_DEPTH = 64  # depth of nested calls


class Frame:
    """One call of a function: its values by id, and the pending blocks, label -> (mask, values of the block's phis)."""

    def __init__(self, function: Function, flow: Flow, outer: Value) -> None:
        self.function, self.flow, self.outer = function, flow, outer
        self.values: dict[int, Value] = {}
        self.own: set[int] = set()  # identities of this call's variables
        self.waiting: dict[int, tuple[Value, dict[int, Value]]] = {}
        self.rounds: dict[int, int] = {}  # label -> number of runs
        self.result: Value = UNDEFINED
        self.returned: Value = False  # the lanes that have returned


class Machine:
    """A module that is ready to run.

    globals  name of a global -> its value; members of an unnamed block are globals themselves
    textures name of a sampler -> its texture
    zero     whether variables that are never set are 0; otherwise, they are rejected if a result depends on them
    """

    def __init__(
        self,
        module: Module,
        globals: Mapping[str, Value] | None = None,
        textures: Mapping[str, Texture] | None = None,
        zero: bool = False,
    ) -> None:
        self.module, self._zero = module, zero
        self._globals = {
            id: Pointer(Cell(initial(module, one, globals or {}, textures or {}, zero)))
            for id, one in module.variables.items()
        }
        self._read_only = {
            id(self._globals[variable].cell): one
            for variable, one in module.variables.items()
            if one.operands[0] in BUFFERS or one.operands[0] == UNIFORM
        }
        self._flows: dict[int, Flow] = {}
        self._named: dict[int, frozenset[int]] = {}  # globals by function
        self._stack: list[int] = []
        self._work = Work(module)

    def call(self, function: Function, arguments: Sequence[Value]) -> Value:
        """The result of a function. Values given for pointer arguments are stored in new variables.

        Raises InputError, with file and line, for unsupported constructs and damaged modules.
        """
        self._work, self._stack = Work(self.module), []
        kinds = [self.module.type(kind).kind for _, kind in function.parameters]
        if len(kinds) != len(arguments):
            raise refuse(f"a function of {len(kinds)} arguments, {len(arguments)} given")
        given = [
            Pointer(Cell(value)) if kind == "pointer" and not isinstance(value, Pointer) else value
            for kind, value in zip(kinds, arguments, strict=True)
        ]
        try:
            return self._recorded(function, given, True)
        finally:
            graph.foreign = ""

    def folded(self, one: Instruction) -> Value:
        """The value of an instruction whose operands are constants."""
        try:
            return self._value(Frame(Function(0, 0), Flow({}, {}), True), one)
        except InputError as error:
            raise InputError(error.what, error.where or f"{one.file}:{one.line}", error.hint) from error

    def variable(self, name: str) -> Value:
        """The current value of a global."""
        for id, one in self._globals.items():
            if self.module.names.get(id) == name:
                return one.cell.value
        raise KeyError(name)

    # ------------------------------------------------------------------ control flow

    def _run(self, function: Function, arguments: Sequence[Value], outer: Value) -> Value:
        if function.id in self._stack or len(self._stack) >= MAX_DEPTH:
            raise refuse(f"recursion of '{self.module.names.get(function.id, function.id)}'", "use a bounded loop")
        if function.id in self.module.refused:
            raise self.module.refused[function.id]
        if not function.blocks:
            raise refuse(f"the function '{self.module.names.get(function.id, function.id)}' has no body")
        if function.id not in self._flows:
            self._flows[function.id] = self._flow(function)
        frame = Frame(function, self._flows[function.id], outer)
        frame.values.update({id: value for (id, _), value in zip(function.parameters, arguments, strict=True)})
        frame.waiting[next(iter(function.blocks))] = True, {}
        self._stack.append(function.id)
        self._work.enter(function)
        with graph.unnamed():
            self._blocks(frame)
        self._stack.pop()
        return frame.result

    def _blocks(self, frame: Frame) -> None:
        while frame.waiting:
            label = min(frame.waiting, key=frame.flow.order.__getitem__)
            mask, phis = frame.waiting.pop(label)
            if not frame.waiting:
                mask = negated(frame.returned)  # all remaining lanes reach this block; this expression is shorter
            for id, value in phis.items():
                self._keep(frame, id, value, mask)
            self._block(frame, frame.function.blocks[label], mask)

    def _flow(self, function: Function) -> Flow:
        try:
            return flow_of(function)
        except InputError:
            raise
        except (IndexError, KeyError, ValueError) as error:
            what = f"the SPIR-V is damaged: {type(error).__name__} {error}"
            raise InputError(what, "SPIR-V", "compile it again") from error

    def _block(self, frame: Frame, block: Block, mask: Value) -> None:
        one: Instruction | None = None
        try:
            for one in block.instructions:
                self._work.step(frame.function)
                graph.foreign = f"{one.file}:{one.line}" if one.line else ""
                if one.name in _FLOW:
                    if self._leave(frame, block, one, mask):
                        return
                elif one.name == "Store":
                    target, value = (self._get(frame, id) for id in one.operands[:2])
                    self._store(frame, block.label, target, value, mask)
                elif one.name == "ExtInst" and one.operands[1] == MODF:
                    fraction, integral = parts(self._get(frame, one.operands[2]))
                    self._store(frame, block.label, self._get(frame, one.operands[3]), integral, mask)
                    self._keep(frame, one.result, fraction, mask)
                elif one.name == "FunctionCall":
                    self._keep(frame, one.result, self._called(frame, one, mask), mask)
                elif one.name not in ("Phi", "SelectionMerge"):
                    self._keep(frame, one.result, self._value(frame, one), mask)
            raise ValueError("a block without an end")
        except InputError as error:
            if error.where or one is None or not one.line:
                raise
            raise InputError(error.what, f"{one.file}:{one.line}", error.hint) from error
        except _DAMAGE as error:
            place = f"{one.file}:{one.line}" if one is not None and one.line else "SPIR-V"
            reason = error.what if isinstance(error, graph.RecordingError) else error
            what = f"the SPIR-V is damaged: {one.name if one else ''}: {type(error).__name__} {reason}"
            raise InputError(what, place, "compile it again") from error

    def _keep(self, frame: Frame, id: int, value: Value, mask: Value) -> None:
        """Set the value of an id; if it is used after its loop, lanes that have left the loop retain the old value."""
        if id in frame.flow.lasting and id in frame.values and not isinstance(value, Pointer):
            value = select(mask, value, frame.values[id])
        self._work.copied(value)
        frame.values[id] = value

    def _leave(self, frame: Frame, block: Block, one: Instruction, mask: Value) -> bool:
        """Whether an instruction ends the block; if so, its successors become pending."""
        operands = one.operands
        if one.name == "LoopMerge":
            self._check_rounds(frame, block.label, mask)
            return False
        if one.name == "Branch":
            self._edge(frame, block.label, operands[0], mask)
        elif one.name == "BranchConditional":
            condition = truth(self._get(frame, operands[0]))
            self._edge(frame, block.label, operands[1], both(mask, condition))
            self._edge(frame, block.label, operands[2], both(mask, negated(condition)))
        elif one.name == "Switch":
            selector, rest = truth(self._get(frame, operands[0])), mask
            for literal, target in zip(operands[2::2], operands[3::2], strict=True):
                known = static(selector)
                equal = wrapped(int(selector), False) == literal if known else selector == float(wrapped(literal, True))
                self._edge(frame, block.label, target, both(rest, equal))
                rest = both(rest, negated(equal))
            self._edge(frame, block.label, operands[1], rest)
        elif one.name == "ReturnValue":
            # lanes that returned earlier retain their results
            frame.result = select(frame.returned, frame.result, self._get(frame, operands[0]))
            frame.returned = either(frame.returned, mask)
        elif one.name in ("Return", "Unreachable"):
            frame.returned = either(frame.returned, mask)
        elif one.name == "Kill":
            raise refuse("discard is not supported", "return a value: a BSDF has no fragments to discard")
        elif one.name == "refused":
            what = REFUSED.get(operands[0], f"SPIR-V's instruction {operands[0]}")
            raise refuse(f"{what} is not supported", ALONE)
        return True

    def _check_rounds(self, frame: Frame, label: int, mask: Value) -> None:
        count = frame.rounds[label] = frame.rounds.get(label, 0) + 1
        if count > MAX_VARYING and not static(mask):
            what = f"a loop without a known end, more than {MAX_VARYING} iterations"
            raise refuse(what, "bound its counter by a constant")
        if count > MAX_ITERATIONS:
            raise refuse(f"a loop of more than {MAX_ITERATIONS} iterations", "use fewer, or a table of its results")

    def _edge(self, frame: Frame, source: int, target: int, mask: Value) -> None:
        if mask is False:
            return
        if target in frame.rounds and source not in frame.flow.loops[target][0]:
            frame.rounds[target] = 0  # the loop is entered again
        before, phis = frame.waiting.get(target, (False, {}))
        fresh = dict(phis)
        for one in frame.function.blocks[target].instructions:
            if one.name == "Phi":
                pairs = dict(zip(one.operands[1::2], one.operands[0::2], strict=True))
                value = self._get(frame, pairs[source])
                fresh[one.result] = select(mask, value, phis.get(one.result, UNDEFINED))
        frame.waiting[target] = either(before, mask), fresh

    def _called(self, frame: Frame, one: Instruction, mask: Value) -> Value:
        function = self.module.functions[one.operands[0]]
        arguments = [self._get(frame, id) for id in one.operands[1:]]
        return self._recorded(function, arguments, both(frame.outer, mask))

    def _recorded(self, function: Function, arguments: Sequence[Value], mask: Value) -> Value:
        """The result of a call; if a recording is active, it contains the call."""
        if not calls.is_recordable(arguments):
            return self._run(function, arguments, mask)
        named = calls.globals_of(self.module, function, self._named)
        cells = {id: self._globals[id].cell for id in sorted(named)}
        with self._work.shared(function):
            return calls.recorded(calls.Recorded(self.module, function, self._run, cells), arguments, mask)

    # ------------------------------------------------------------------ values

    def _get(self, frame: Frame, id: int) -> Value:
        for known in (frame.values, self.module.constants, self._globals):
            if id in known:
                return known[id]
        raise KeyError(f"id {id} has no value")

    def _store(self, frame: Frame, label: int, target: Value, value: Value, mask: Value) -> None:
        if not isinstance(target, Pointer):
            raise TypeError("a store to no pointer")
        if id(target.cell) in self._read_only:
            raise refuse(f"a write to the buffer '{self._buffer(target)}'", ALONE)
        if not target.path:
            calls.named(value, self.module.names.get(target.cell.id, ""))
        own = id(target.cell) in frame.own
        if not own:
            mask = both(frame.outer, mask)
        elif not static(mask) and self._unread_elsewhere(frame, label, target.cell):
            mask = True
        target.store(value, mask)
        self._work.copied(target.cell.value)

    def _buffer(self, target: Pointer) -> str:
        """The name of a buffer; if it has none, as in GLSL, the name of its member."""
        one = self._read_only[id(target.cell)]
        inside = self.module.type(one.type).parts[0]
        member = self.module.members.get((inside, target.path[0])) if target.path and static(target.path[0]) else None
        return self.module.names.get(one.result) or member or self.module.names.get(inside, "")

    def _unread_elsewhere(self, frame: Frame, label: int, cell: Cell) -> bool:
        """Whether lanes outside this block never read a variable's current value, so that a store needs no mask.

        This is the case if all lanes of a loop are in the block and only the loop reads the variable. Loop counters
        thus remain plain numbers.
        """
        reads = frame.flow.reads.get(cell.id, set())
        for loop in (*frame.flow.loops[label], frozenset(frame.flow.order)):
            if any(waiting in loop for waiting in frame.waiting):
                return False
            if reads <= loop:
                return True
        return False

    def _value(self, frame: Frame, one: Instruction) -> Value:
        name = one.name
        if name == "Variable":
            known = self._get(frame, one.operands[1]) if len(one.operands) > 1 else self._unset(one)
            cell = Cell(known, one.result)
            frame.own.add(id(cell))
            frame.values[-one.result] = cell  # keeps the cell alive, so that its id is not reused
            return Pointer(cell)
        if name == "ExtInst":
            return self._standard(frame, one)
        if name in composites.LITERAL:
            count = composites.LITERAL[name]
            values = [self._get(frame, id) for id in one.operands[:count]]
            return composites.literal(name, values, one.operands[count:])
        arguments = one.operands[:2] if name in ("ImageSample", "ImageFetch") else one.operands  # ids only
        values = [self._get(frame, id) for id in arguments]
        if name == "Load":
            if not isinstance(values[0], Pointer):
                raise TypeError("no pointer")
            return values[0].load(f"{one.file}:{one.line}" if one.line else "")
        if name in _IMAGES:
            return sampled(name, values)
        if name in composites.COMPOSED:
            return composites.COMPOSED[name](self.module, one.type, *values)
        if name == "Bitcast":
            source = frame.function.types.get(one.operands[0], one.type)  # `types` does not contain constants
            before, after = self._scalar(source), self._scalar(one.type)
            return elementwise(passing(lambda part: cast(part, before, after)), *values)
        return self._arithmetic(one, values)

    def _scalar(self, id: int) -> str:
        """The kind of a scalar type, or of a vector's components."""
        kind = self.module.type(id)
        return (self.module.type(kind.parts[0]) if kind.parts else kind).kind

    def _unset(self, one: Instruction) -> Value:
        """The value of a function's variable before its first store."""
        inside = self.module.type(one.type).parts[0]
        if self._zero:
            return self.module.zero(inside)
        what = f"the variable '{self.module.names.get(one.result, '')}' is read before it is assigned"
        return self.module.undefined(inside, Undefined(what, "give it an initial value"))

    def _arithmetic(self, one: Instruction, values: list[Value]) -> Value:
        name = one.name
        self._check_width(one.type)
        if name in LOGIC:
            return elementwise(LOGIC[name], *values)
        for table in (FLOATS, COMPARED):
            if name in table:
                return elementwise(passing(table[name]), *values)
        if name in INTEGERS:
            signed = self._scalar(one.type) == "int"

            def on_integers(*scalars: Value) -> Value:
                value = INTEGERS[name](*scalars)
                return wrapped(value, signed) if isinstance(value, int) else value

            return elementwise(passing(on_integers), *values)
        if name in WHOLE:
            return WHOLE[name](*values)
        raise refuse(f"operations on the bits of a number ({name}) are not supported", "compute with floats")

    def _check_width(self, id: int) -> None:
        kind = self._scalar(id)
        if "-bit" in kind:
            hint = "declare 32-bit numbers; Gonio can evaluate them in double precision"
            raise refuse(f"{kind}s are not supported", hint)

    def _standard(self, frame: Frame, one: Instruction) -> Value:
        if self.module.sets.get(one.operands[0]) != "GLSL.std.450":
            return UNDEFINED  # debug information
        self._check_width(one.type)
        number, values = one.operands[1], [self._get(frame, id) for id in one.operands[2:]]
        undefined = lost(leaf for value in values for leaf in leaves(value))
        if number in GEOMETRIC:
            return GEOMETRIC[number](*values) if undefined is None else self.module.undefined(one.type, undefined)
        if number in ELEMENTWISE or number in WHOLE_NUMBERS:
            return elementwise(passing(ELEMENTWISE.get(number) or WHOLE_NUMBERS[number]), *values)
        what = REFUSED_FUNCTIONS.get(number, f"the function {number} of SPIR-V's GLSL.std.450")
        raise refuse(f"{what} is not supported", "compute with floats")


_DAMAGE = (IndexError, KeyError, ValueError, TypeError, AttributeError, OverflowError, RecursionError,
           graph.RecordingError)  # fmt: skip
_FLOW = frozenset({"LoopMerge", "Branch", "BranchConditional", "Switch", "Return", "ReturnValue", "Kill",
                   "Unreachable", "refused"})  # fmt: skip
_IMAGES = frozenset({"SampledImage", "Image", "ImageSample", "ImageFetch", "ImageQuerySize"})
