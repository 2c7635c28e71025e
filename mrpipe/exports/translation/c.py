"""Compiled steps as C99."""

from __future__ import annotations

import ast
from collections.abc import Iterable

from mrpipe.exports.translation.routines import (
    CONSTANTS,
    MATHEMATICS,
    Kind,
    Routine,
    array_argument,
    called,
    is_length,
    is_negative,
)
from mrpipe.exports.translation.writer import Writer

_HELPERS = {
    "min_real": "static double min_real(double a, double b) { return b < a ? b : a; }",
    "max_real": "static double max_real(double a, double b) { return b > a ? b : a; }",
    "min_long": "static long min_long(long a, long b) { return b < a ? b : a; }",
    "max_long": "static long max_long(long a, long b) { return b > a ? b : a; }",
    "modulo_long": "static long modulo_long(long a, long b) { return (a % b + b) % b; }",
    "modulo_real": "static double modulo_real(double a, double b) { return a - b * floor(a / b); }",
}
"""Functions that translated text may call. As in Python, min and max return the first of two equal numbers, and a
remainder has the sign of the divisor."""

_KEYWORDS = frozenset({
    "auto", "break", "case", "char", "const", "continue", "default", "do", "double", "else", "enum", "extern",
    "float", "for", "goto", "if", "inline", "int", "long", "register", "restrict", "return", "short", "signed",
    "sizeof", "static", "struct", "switch", "typedef", "union", "unsigned", "void", "volatile", "while",
})  # fmt: skip
_TYPES: dict[Kind, str] = {"real": "double", "integer": "long", "truth": "int", "array": "double *"}
_OPERATORS = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*"}
_COMPARISONS = {ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!="}


def literal(value: float) -> str:
    """Return a C literal that reads back to the same double."""
    if value != value:
        return "NAN"
    if value in (float("inf"), float("-inf")):
        return "HUGE_VAL" if value > 0 else "-HUGE_VAL"
    return repr(float(value))


def safe(name: str) -> str:
    """Return a name that C allows for a variable."""
    return f"{name}_" if name in _KEYWORDS else name


def c_functions(routines: Iterable[Routine]) -> str:
    """Return C functions in the order of the routines."""
    return "\n".join(_Writer(routine).function() for routine in routines)


def helpers_of(text: str) -> str:
    """Return the definitions of the helper functions that a text calls."""
    return "".join(f"{definition}\n" for name, definition in _HELPERS.items() if f"{name}(" in text)


class _Writer(Writer):
    """Writes one routine."""

    def __init__(self, routine: Routine) -> None:
        super().__init__(routine)
        self.loops = 0

    def function(self) -> str:
        routine = self.routine
        arguments = []
        for name, kind in routine.arguments.items():
            if kind == "array":
                arguments.append(f"{'' if name in routine.written else 'const '}double *{safe(name)}")
                if name in routine.measured:
                    arguments.append(f"long {name}_size")
            else:
                arguments.append(f"{_TYPES[kind]} {safe(name)}")
        result = "void" if routine.result is None else _TYPES[routine.result]
        for name, kind in sorted(routine.types.items()):
            self.line(f"{_TYPES[kind]} {safe(name)} = 0;")
        used = {node.id for node in ast.walk(ast.Module(routine.tree.body, [])) if isinstance(node, ast.Name)}
        for name in routine.arguments:
            if name not in used:
                self.line(f"(void){safe(name)};")
        self.block(routine.tree.body)
        body = "\n".join(self.lines)
        return f"static {result} {routine.name}({', '.join(arguments)})\n{{\n{body}\n}}\n"

    def control(self, node: ast.stmt) -> None:
        if isinstance(node, ast.If):
            self.line(f"if ({self.value(node.test)}) {{")
            self.inner(node.body)
            if node.orelse:
                self.line("} else {")
                self.inner(node.orelse)
            self.line("}")
        elif isinstance(node, ast.While) and not node.orelse:
            self.line(f"while ({self.value(node.test)}) {{")
            self.inner(node.body)
            self.line("}")
        elif isinstance(node, ast.Break):
            self.line("break;")
        elif isinstance(node, ast.Continue):
            self.line("continue;")
        elif isinstance(node, ast.Return):
            self.line("return;" if node.value is None else f"return {self.value(node.value)};")
        elif isinstance(node, ast.Expr) and isinstance(node.value, ast.Call):
            self.line(f"{self.value(node.value)};")
        else:
            raise self.refuse(node)

    def exchange(self, pairs: list[tuple[ast.expr, ast.expr]]) -> None:
        self.line("{")
        self.depth += 1
        for place, (_, value) in enumerate(pairs):
            self.line(f"const {_TYPES[self.routine.kind_of(value)]} new_{place} = {self.value(value)};")
        for place, (item, _) in enumerate(pairs):
            self.set(item, f"new_{place}")
        self.depth -= 1
        self.line("}")

    def loop(self, node: ast.For) -> None:
        variable, start, stop, step, down = self.range_of(node)
        self.loops += 1
        name, end = safe(variable), f"end_{self.loops}"
        self.line("{")
        self.line(f"const long {end} = {stop};")
        self.line(f"for ({name} = {start}; {name} {'>' if down else '<'} {end}; {name} += {step}) {{")
        self.inner(node.body)
        self.line("}")
        self.line("}")

    def target(self, node: ast.expr) -> str:
        if isinstance(node, ast.Name):
            return safe(node.id)
        if isinstance(node, ast.Subscript) and isinstance(node.value, ast.Name):
            return f"{safe(node.value.id)}[{self.index(node)}]"
        raise self.refuse(node)

    def index(self, node: ast.Subscript) -> str:
        if is_negative(node.slice) and isinstance(node.value, ast.Name):
            return f"{node.value.id}_size{self.value(node.slice)}"
        return self.value(node.slice)

    def value(self, node: ast.expr) -> str:
        if isinstance(node, ast.Constant) and isinstance(node.value, int | float):
            return str(int(node.value)) if isinstance(node.value, int) else literal(node.value)
        if isinstance(node, ast.Name):
            return self.name(node)
        if isinstance(node, ast.Attribute) and node.attr in CONSTANTS:
            return literal(CONSTANTS[node.attr])
        if isinstance(node, ast.Subscript):
            return f"{ast.unparse(node.value).split('.')[0]}_size" if is_length(node) else self.target(node)
        if isinstance(node, ast.BinOp):
            return self.binary(node)
        if isinstance(node, ast.UnaryOp):
            sign = "!" if isinstance(node.op, ast.Not) else "-" if isinstance(node.op, ast.USub) else ""
            inner = self.value(node.operand)
            return f"{sign}{inner}" if isinstance(node.operand, ast.Constant | ast.Name) else f"{sign}({inner})"
        if isinstance(node, ast.BoolOp):
            return "(" + (" && " if isinstance(node.op, ast.And) else " || ").join(map(self.value, node.values)) + ")"
        if isinstance(node, ast.Compare):
            return self.comparison(node)
        if isinstance(node, ast.IfExp):
            return f"({self.value(node.test)} ? {self.value(node.body)} : {self.value(node.orelse)})"
        if isinstance(node, ast.Call):
            return self.call(node)
        raise self.refuse(node)

    def name(self, node: ast.Name) -> str:
        constant = self.routine.constants.get(node.id)
        if constant is None or node.id in self.routine.types:
            return safe(node.id)
        return str(constant) if isinstance(constant, int) else literal(constant)

    def binary(self, node: ast.BinOp) -> str:
        left, right = self.value(node.left), self.value(node.right)
        whole = self.routine.kind_of(node) == "integer"
        if isinstance(node.op, ast.Div):
            return (
                f"((double){left} / {right})" if self.routine.kind_of(node.left) == "integer" else f"({left} / {right})"
            )
        if isinstance(node.op, ast.Pow):
            return f"pow({left}, {right})"
        if isinstance(node.op, ast.Mod):
            return f"modulo_{'long' if whole else 'real'}({left}, {right})"
        if isinstance(node.op, ast.FloorDiv):
            return f"(({left} - modulo_long({left}, {right})) / {right})" if whole else f"floor({left} / {right})"
        operator = _OPERATORS.get(type(node.op))
        if operator is None:
            raise self.refuse(node)
        return f"({left} {operator} {right})"

    def comparison(self, node: ast.Compare) -> str:
        values = [node.left, *node.comparators]
        parts = []
        for place, operator in enumerate(node.ops):
            sign = _COMPARISONS.get(type(operator))
            if sign is None:
                raise self.refuse(node)
            parts.append(f"{self.value(values[place])} {sign} {self.value(values[place + 1])}")
        return f"({' && '.join(parts)})"

    def call(self, node: ast.Call) -> str:
        name = called(node)
        if name in self.routine.calls:
            return self.call_of(self.routine.calls[name], node)
        arguments = [self.value(item) for item in node.args]
        whole = self.routine.kind_of(node) == "integer"
        if name in ("min", "max"):
            result = arguments[0]
            for item in arguments[1:]:
                result = f"{name}_{'long' if whole else 'real'}({result}, {item})"
            return result
        if name == "abs":
            return f"{'labs' if whole else 'fabs'}({arguments[0]})"
        if name == "int":
            return f"(long)({arguments[0]})"
        if name in ("ceil", "floor"):
            return f"(long){name}({arguments[0]})"
        if name == "float":
            return f"(double)({arguments[0]})"
        if name in MATHEMATICS:
            return f"{name}({', '.join(arguments)})"
        raise self.routine.refuse(node, f"the function {name}")

    def call_of(self, other: Routine, node: ast.Call) -> str:
        arguments = []
        for (name, kind), given in zip(other.arguments.items(), node.args, strict=True):
            if kind != "array":
                arguments.append(self.value(given))
                continue
            array = array_argument(given)
            if array is None:
                raise self.refuse(given)
            start, stop = "0", f"{array}_size"
            if isinstance(given, ast.Subscript) and isinstance(given.slice, ast.Slice):
                start = self.value(given.slice.lower) if given.slice.lower else "0"
                stop = self.value(given.slice.upper) if given.slice.upper else stop
            arguments.append(safe(array) if start == "0" else f"{safe(array)} + {start}")
            if name in other.measured:
                arguments.append(stop if start == "0" else f"{stop} - {start}")
        return f"{other.name}({', '.join(arguments)})"
