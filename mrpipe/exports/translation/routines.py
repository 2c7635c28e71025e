"""Functions that a chain calls, and their properties for a translator: types, constants, changed arrays."""

from __future__ import annotations

import ast
import inspect
import textwrap
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from mrpipe.errors import UserError

Kind = Literal["array", "real", "integer", "truth"]
"""Type of a value: array of reals, real number, integer, or truth value."""

MATHEMATICS = frozenset({
    "acos", "asin", "atan", "atan2", "atanh", "ceil", "copysign", "cos", "cosh", "exp", "expm1", "fabs", "floor",
    "fmod", "hypot", "log", "log10", "log1p", "pow", "sin", "sinh", "sqrt", "tan", "tanh", "asinh", "acosh",
})  # fmt: skip
"""Functions of `math` (or of numpy for single numbers) that every target language has."""

CONSTANTS = {"pi": 3.141592653589793, "e": 2.718281828459045}


@dataclass
class Routine:
    """A function to be translated.

    Attributes
    ----------
    name
        Unique name in the target.
    tree
        Definition of the function without the docstring.
    arguments
        Name -> type.
    constants
        Names of numbers of its module -> value.
    calls
        Names of other routines in its text -> routine.
    python
        Compiled function.
    written
        Arrays among the arguments that it (or what it calls) changes.
    measured
        Arrays among the arguments whose length it (or what it calls) needs.
    types
        Local variable -> type.
    result
        Type of the returned value; None if the function returns nothing.
    """

    name: str
    tree: ast.FunctionDef
    arguments: dict[str, Kind]
    constants: dict[str, float | int]
    calls: dict[str, Routine]
    python: Any
    written: set[str] = field(default_factory=set)
    measured: set[str] = field(default_factory=set)
    types: dict[str, Kind] = field(default_factory=dict)
    result: Kind | None = None

    def refuse(self, node: ast.AST, problem: str) -> UserError:
        """Return the error for a part of the text that has no translation."""
        line = self.python.__code__.co_firstlineno + getattr(node, "lineno", 1) - 1
        return UserError(
            self.python.__code__.co_filename,
            f"{self.tree.name}, line {line}",
            f"{problem} cannot be translated",
            "use numbers, arrays, if, for, while, math functions and other compiled functions only",
        )

    def kind_of(self, node: ast.expr) -> Kind:
        """Return the type of an expression."""
        if isinstance(node, ast.Constant):
            return "truth" if isinstance(node.value, bool) else "integer" if isinstance(node.value, int) else "real"
        if isinstance(node, ast.Name):
            return self._kind_of_name(node)
        if isinstance(node, ast.Subscript):
            if isinstance(node.slice, ast.Slice):
                return "array"
            return "integer" if is_length(node) else "real"
        if isinstance(node, ast.BinOp):
            if isinstance(node.op, ast.Div):
                return "real"
            both = {self.kind_of(node.left), self.kind_of(node.right)}
            return "integer" if both <= {"integer", "truth"} else "real"
        if isinstance(node, ast.UnaryOp):
            return "truth" if isinstance(node.op, ast.Not) else self.kind_of(node.operand)
        if isinstance(node, ast.Compare | ast.BoolOp):
            return "truth"
        if isinstance(node, ast.IfExp):
            return wider(self.kind_of(node.body), self.kind_of(node.orelse))
        if isinstance(node, ast.Call):
            return self._kind_of_call(node)
        raise self.refuse(node, f"`{ast.unparse(node)}`")

    def _kind_of_name(self, node: ast.Name) -> Kind:
        if node.id in self.arguments:
            return self.arguments[node.id]
        if node.id in self.types:
            return self.types[node.id]
        if node.id in self.constants:
            return "integer" if isinstance(self.constants[node.id], int) else "real"
        raise self.refuse(node, f"the name {node.id}")

    def _kind_of_call(self, node: ast.Call) -> Kind:
        name = called(node)
        if name in self.calls:
            return self.calls[name].result or "real"
        if name in ("int", "ceil", "floor", "range"):
            return "integer"
        if name in ("min", "max", "abs"):
            kinds = {self.kind_of(item) for item in node.args}
            return "integer" if kinds == {"integer"} else "real"
        if name == "float" or name in MATHEMATICS:
            return "real"
        raise self.refuse(node, f"the function {name}")


def wider(first: Kind, second: Kind) -> Kind:
    """Return the type that holds values of both types."""
    if first == second:
        return first
    return "real" if "real" in (first, second) else "integer"


def called(node: ast.Call) -> str:
    """Return the name of a called function without its module (`math.exp` -> `exp`)."""
    return node.func.attr if isinstance(node.func, ast.Attribute) else ast.unparse(node.func)


def is_length(node: ast.expr) -> bool:
    """Return whether an expression is `array.shape[0]`."""
    return isinstance(node, ast.Subscript) and isinstance(node.value, ast.Attribute) and node.value.attr == "shape"


def is_negative(node: ast.expr) -> bool:
    """Return whether an index counts from the end of an array."""
    return isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub)


def array_argument(node: ast.expr) -> str | None:
    """Return the array that an expression names as a whole or in part; None for numbers."""
    if isinstance(node, ast.Name):
        return node.id
    if isinstance(node, ast.Subscript) and isinstance(node.slice, ast.Slice) and isinstance(node.value, ast.Name):
        return node.value.id
    return None


def routines_of(functions: Iterable[Any]) -> list[Routine]:
    """Return the routines that compiled functions need, each after all that it calls.

    Parameters
    ----------
    functions
        Functions compiled by numba.

    Raises
    ------
    UserError
        If a function uses something that has no translation.
    """
    found: dict[Any, Routine] = {}
    names: set[str] = set()
    for function in functions:
        _collect(function, found, names)
    return list(found.values())


def _collect(function: Any, found: dict[Any, Routine], names: set[str]) -> Routine:
    python = function.py_func
    if python in found:
        return found[python]
    tree = ast.parse(textwrap.dedent(inspect.getsource(python))).body[0]
    if not isinstance(tree, ast.FunctionDef):
        raise UserError(python.__module__, python.__name__, "is not a function", "write it with def")
    if isinstance(tree.body[0], ast.Expr) and isinstance(tree.body[0].value, ast.Constant):
        del tree.body[0]
    body = ast.Module(tree.body, [])
    used = {node.id for node in ast.walk(body) if isinstance(node, ast.Name)} - {item.arg for item in tree.args.args}
    known: Mapping[str, Any] = {**python.__globals__, **inspect.getclosurevars(python).nonlocals}
    calls, constants = {}, {}
    for name in sorted(used & set(known)):
        value = known[name]
        if hasattr(value, "py_func"):
            calls[name] = _collect(value, found, names)
        elif isinstance(value, int | float) and not isinstance(value, bool):
            constants[name] = value
    routine = Routine(
        _unique(python, names),
        tree,
        _argument_types(function, tree),
        constants,
        calls,
        python,
    )
    found[python] = routine
    _find_local_types(routine)
    _find_changes(routine)
    return routine


def _unique(python: Any, names: set[str]) -> str:
    # the prefix keeps the names apart from those of the C library
    name = f"mr_{python.__name__.strip('_')}"
    if name in names:
        name = f"mr_{python.__module__.rsplit('.', 1)[-1]}_{python.__name__.strip('_')}"
    while name in names:
        name += "_"
    names.add(name)
    return name


def _argument_types(function: Any, tree: ast.FunctionDef) -> dict[str, Kind]:
    """Return the types of the compiled signature; without a signature, those in the source text."""
    names = [item.arg for item in tree.args.args]
    if function.nopython_signatures:
        from numba import types

        kinds: list[Kind] = [
            "array" if isinstance(item, types.Array) else "integer" if isinstance(item, types.Integer) else "real"
            for item in function.nopython_signatures[0].args
        ]
        return dict(zip(names, kinds, strict=True))
    indexed = {
        node.value.id for node in ast.walk(tree) if isinstance(node, ast.Subscript) and isinstance(node.value, ast.Name)
    }
    return {name: "array" if name in indexed else "real" for name in names}


def _find_local_types(routine: Routine) -> None:
    """Fill `types` and `result`: a variable that is ever given a real number is real."""
    for _ in range(8):
        before = dict(routine.types)
        for node in ast.walk(ast.Module(routine.tree.body, [])):
            for name, value in _given(node):
                try:
                    kind: Kind = "integer" if value is None else routine.kind_of(value)
                except UserError:
                    continue
                routine.types[name] = wider(routine.types.get(name, kind), kind)
        if routine.types == before:
            break
    returned = [node.value for node in ast.walk(routine.tree) if isinstance(node, ast.Return) and node.value]
    for value in returned:
        kind = routine.kind_of(value)
        routine.result = kind if routine.result is None else wider(routine.result, kind)
    routine.types = {name: kind for name, kind in routine.types.items() if name not in routine.arguments}


def _given(node: ast.AST) -> list[tuple[str, ast.expr | None]]:
    """Return the local variables that a statement sets, with what each is set to (None: the count of a loop)."""
    if isinstance(node, ast.For) and isinstance(node.target, ast.Name):
        return [(node.target.id, None)]
    if isinstance(node, ast.AugAssign) and isinstance(node.target, ast.Name):
        return [(node.target.id, ast.BinOp(node.target, node.op, node.value))]
    if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name) and node.value is not None:
        return [(node.target.id, node.value)]
    if not isinstance(node, ast.Assign):
        return []
    pairs: list[tuple[str, ast.expr | None]] = []
    for target in node.targets:
        if isinstance(target, ast.Name):
            pairs.append((target.id, node.value))
        elif isinstance(target, ast.Tuple) and isinstance(node.value, ast.Tuple):
            inner = zip(target.elts, node.value.elts, strict=True)
            pairs += [(item.id, value) for item, value in inner if isinstance(item, ast.Name)]
    return pairs


def _find_changes(routine: Routine) -> None:
    """Fill `written` and `measured` from the text and from what it calls."""
    for node in ast.walk(ast.Module(routine.tree.body, [])):
        if isinstance(node, ast.Subscript) and isinstance(node.value, ast.Name):
            if isinstance(node.ctx, ast.Store):
                routine.written.add(node.value.id)
            if is_negative(node.slice):
                routine.measured.add(node.value.id)
        elif isinstance(node, ast.Subscript) and is_length(node):
            routine.measured.add(ast.unparse(node.value).split(".")[0])
        elif isinstance(node, ast.Call) and called(node) in routine.calls:
            other = routine.calls[called(node)]
            for name, given in zip(other.arguments, node.args, strict=True):
                array = array_argument(given)
                if array is not None and name in other.written:
                    routine.written.add(array)
                if array is not None and name in other.measured:
                    routine.measured.add(array)
