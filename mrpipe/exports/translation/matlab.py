"""Compiled steps as MATLAB functions, which GNU Octave runs as well.

MATLAB passes values. A function therefore returns the arrays that it changes, after its own result.
"""

from __future__ import annotations

import ast
from collections.abc import Iterable

from mrpipe.exports.translation.routines import (
    CONSTANTS,
    MATHEMATICS,
    Routine,
    array_argument,
    called,
    is_length,
    is_negative,
)
from mrpipe.exports.translation.writer import Writer

HELPERS = """\
function value = mr_pick(condition, first, second)
    if condition
        value = first;
    else
        value = second;
    end
end

function value = mr_copysign(size_of, sign_of)
    value = abs(size_of) * (1 - 2 * (sign_of < 0));
end
"""

_KEYWORDS = frozenset({
    "break", "case", "catch", "classdef", "continue", "else", "elseif", "end", "for", "function", "global", "if",
    "otherwise", "parfor", "persistent", "return", "spmd", "switch", "try", "while", "until", "do",
    "unwind_protect",
})  # fmt: skip
_OPERATORS = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.Pow: "^"}
_COMPARISONS = {ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "~="}
_NAMES = {"fabs": "abs", "fmod": "rem", "copysign": "mr_copysign"}


def number(value: float) -> str:
    """Return a MATLAB number that reads back to the same double."""
    if value != value:
        return "NaN"
    if value in (float("inf"), float("-inf")):
        return "Inf" if value > 0 else "-Inf"
    return repr(float(value))


def safe(name: str) -> str:
    """Return a name that MATLAB allows for a variable."""
    name = f"x{name}" if name.startswith("_") else name
    return f"{name}_" if name in _KEYWORDS else name


def outputs_of(routine: Routine, given: dict[str, str]) -> list[str]:
    """Return the targets of the arrays that a call changes; `given` maps parameters to arguments."""
    return [given[name] for name in routine.arguments if name in routine.written]


def matlab_functions(routines: Iterable[Routine]) -> str:
    """Return MATLAB functions, and those that they share."""
    return "\n".join([*(_Writer(routine).function() for routine in routines), HELPERS])


class _Writer(Writer):
    """Writes one routine."""

    def __init__(self, routine: Routine) -> None:
        super().__init__(routine)
        self.hoisted = 0
        self.conditional = 0

    def function(self) -> str:
        routine = self.routine
        results = ["result"] if routine.result is not None else []
        results += [safe(name) for name in routine.arguments if name in routine.written]
        self.block(routine.tree.body)
        body = "\n".join(self.lines)
        head = f"[{', '.join(results)}] = " if results else ""
        return f"function {head}{routine.name}({', '.join(map(safe, routine.arguments))})\n{body}\nend\n"

    def control(self, node: ast.stmt) -> None:
        if isinstance(node, ast.If):
            self.line(f"if {self.value(node.test)}")
            self.inner(node.body)
            if node.orelse:
                self.line("else")
                self.inner(node.orelse)
            self.line("end")
        elif isinstance(node, ast.While) and not node.orelse:
            self.line(f"while {self.in_part(node.test)}")
            self.inner(node.body)
            self.line("end")
        elif isinstance(node, ast.Break | ast.Continue):
            self.line("break;" if isinstance(node, ast.Break) else "continue;")
        elif isinstance(node, ast.Return):
            if node.value is not None:
                self.line(f"result = {self.value(node.value)};")
            self.line("return;")
        elif isinstance(node, ast.Expr) and isinstance(node.value, ast.Call):
            self.value(node.value)
        else:
            raise self.refuse(node)

    def exchange(self, pairs: list[tuple[ast.expr, ast.expr]]) -> None:
        for place, (_, value) in enumerate(pairs):
            self.line(f"new_{place} = {self.value(value)};")
        for place, (item, _) in enumerate(pairs):
            self.set(item, f"new_{place}")

    def loop(self, node: ast.For) -> None:
        name, start, stop, step, down = self.range_of(node)
        last = f"{stop} + 1" if down else f"{stop} - 1"
        self.line(f"for {safe(name)} = {start}:{step}:({last})")
        self.inner(node.body)
        self.line("end")

    def target(self, node: ast.expr) -> str:
        if isinstance(node, ast.Name):
            return safe(node.id)
        if isinstance(node, ast.Subscript) and isinstance(node.value, ast.Name):
            name = safe(node.value.id)
            if is_negative(node.slice) and isinstance(node.slice, ast.UnaryOp):
                return f"{name}(numel({name}) + 1 - {self.value(node.slice.operand)})"
            if isinstance(node.slice, ast.Constant):
                return f"{name}({int(str(node.slice.value)) + 1})"
            return f"{name}({self.value(node.slice)} + 1)"
        raise self.refuse(node)

    def value(self, node: ast.expr) -> str:
        if isinstance(node, ast.Constant) and isinstance(node.value, int | float):
            return str(int(node.value)) if isinstance(node.value, int) else number(node.value)
        if isinstance(node, ast.Name):
            constant = self.routine.constants.get(node.id)
            return safe(node.id) if constant is None or node.id in self.routine.types else number(constant)
        if isinstance(node, ast.Attribute) and node.attr in CONSTANTS:
            return number(CONSTANTS[node.attr])
        if isinstance(node, ast.Subscript):
            if is_length(node):
                return f"numel({safe(ast.unparse(node.value).split('.')[0])})"
            return self.target(node)
        if isinstance(node, ast.BinOp):
            return self.binary(node)
        if isinstance(node, ast.UnaryOp):
            sign = "~" if isinstance(node.op, ast.Not) else "-" if isinstance(node.op, ast.USub) else ""
            return f"({sign}{self.value(node.operand)})"
        if isinstance(node, ast.BoolOp):
            sign = " && " if isinstance(node.op, ast.And) else " || "
            return f"({sign.join(self.in_part(item) for item in node.values)})"
        if isinstance(node, ast.Compare):
            values = [node.left, *node.comparators]
            pairs = zip(values[:-1], node.ops, values[1:], strict=True)
            return (
                "("
                + " && ".join(f"{self.value(a)} {_COMPARISONS[type(op)]} {self.value(b)}" for a, op, b in pairs)
                + ")"
            )
        if isinstance(node, ast.IfExp):
            return f"mr_pick({self.value(node.test)}, {self.in_part(node.body)}, {self.in_part(node.orelse)})"
        if isinstance(node, ast.Call):
            return self.call(node)
        raise self.refuse(node)

    def in_part(self, node: ast.expr) -> str:
        """Return an expression that may not be evaluated, or more than once: a call there cannot change arrays."""
        self.conditional += 1
        text = self.value(node)
        self.conditional -= 1
        return text

    def binary(self, node: ast.BinOp) -> str:
        left, right = self.value(node.left), self.value(node.right)
        if isinstance(node.op, ast.Mod):
            return f"mod({left}, {right})"
        if isinstance(node.op, ast.FloorDiv):
            return f"floor({left} / {right})"
        operator = _OPERATORS.get(type(node.op))
        if operator is None:
            raise self.refuse(node)
        return f"({left} {operator} {right})"

    def call(self, node: ast.Call) -> str:
        name = called(node)
        if name in self.routine.calls:
            return self.call_of(self.routine.calls[name], node)
        arguments = [self.value(item) for item in node.args]
        if name in ("min", "max"):
            result = arguments[0]
            for item in arguments[1:]:
                result = f"{name}({result}, {item})"
            return result
        if name in ("int", "float"):
            return f"fix({arguments[0]})" if name == "int" else arguments[0]
        if name == "pow":
            return f"({arguments[0]} ^ {arguments[1]})"
        if name == "abs" or name in MATHEMATICS:
            return f"{_NAMES.get(name, name)}({', '.join(arguments)})"
        raise self.routine.refuse(node, f"the function {name}")

    def call_of(self, other: Routine, node: ast.Call) -> str:
        given: dict[str, str] = {}
        for (name, kind), item in zip(other.arguments.items(), node.args, strict=True):
            given[name] = self.part(item) if kind == "array" else self.value(item)
        text = f"{other.name}({', '.join(given.values())})"
        changed = outputs_of(other, given)
        if not changed:
            return text
        if self.conditional:
            raise self.routine.refuse(node, f"a call of {called(node)} within a condition, which changes an array,")
        if other.result is None:
            self.line(f"[{', '.join(changed)}] = {text};")
            return ""
        self.hoisted += 1
        self.line(f"[found_{self.hoisted}, {', '.join(changed)}] = {text};")
        return f"found_{self.hoisted}"

    def part(self, node: ast.expr) -> str:
        array = array_argument(node)
        if array is None:
            raise self.refuse(node)
        if not (isinstance(node, ast.Subscript) and isinstance(node.slice, ast.Slice)):
            return safe(array)
        start = self.value(node.slice.lower) if node.slice.lower else "0"
        stop = self.value(node.slice.upper) if node.slice.upper else f"numel({safe(array)})"
        return f"{safe(array)}({start} + 1:{stop})"
