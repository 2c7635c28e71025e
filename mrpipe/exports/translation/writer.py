"""Parts that the translations of compiled steps share: indented lines, assignments, bounds of loops."""

from __future__ import annotations

import ast
from abc import ABC, abstractmethod
from collections.abc import Iterable

from mrpipe.errors import UserError
from mrpipe.exports.translation.routines import Routine, called, is_negative


class Writer(ABC):
    """Writes one routine in another language.

    Parameters
    ----------
    routine
        Function that is translated.
    """

    def __init__(self, routine: Routine) -> None:
        self.routine = routine
        self.lines: list[str] = []
        self.depth = 1

    def line(self, text: str) -> None:
        """Add a line at the present depth."""
        self.lines.append("    " * self.depth + text)

    def block(self, statements: Iterable[ast.stmt]) -> None:
        """Write statements at the present depth."""
        for statement in statements:
            self.statement(statement)

    def inner(self, statements: Iterable[ast.stmt]) -> None:
        """Write statements one level deeper."""
        self.depth += 1
        self.block(statements)
        self.depth -= 1

    def statement(self, node: ast.stmt) -> None:
        """Write one statement."""
        if isinstance(node, ast.Assign):
            for target in node.targets:
                if isinstance(target, ast.Tuple):
                    self.set_all(target, node)
                else:
                    self.set(target, self.value(node.value))
        elif isinstance(node, ast.AnnAssign) and node.value is not None:
            self.set(node.target, self.value(node.value))
        elif isinstance(node, ast.AugAssign):
            combined = ast.BinOp(node.target, node.op, node.value)
            ast.copy_location(combined, node)
            self.set(node.target, self.value(combined))
        elif isinstance(node, ast.For) and not node.orelse:
            self.loop(node)
        elif not isinstance(node, ast.Pass):
            self.control(node)

    def set(self, target: ast.expr, value: str) -> None:
        """Write an assignment."""
        self.line(f"{self.target(target)} = {value};")

    def set_all(self, target: ast.Tuple, node: ast.Assign) -> None:
        """Write an assignment of several values, which are all read before any is set."""
        if not isinstance(node.value, ast.Tuple):
            raise self.refuse(node)
        self.exchange(list(zip(target.elts, node.value.elts, strict=True)))

    def range_of(self, node: ast.For) -> tuple[str, str, str, str, bool]:
        """Return name, start, stop and step of a loop over a range, and whether it counts down.

        Raises
        ------
        UserError
            If the loop is over something else.
        """
        if not (isinstance(node.iter, ast.Call) and called(node.iter) == "range" and isinstance(node.target, ast.Name)):
            raise self.routine.refuse(node, f"a loop over `{ast.unparse(node.iter)}`")
        bounds = [self.value(item) for item in node.iter.args]
        start, stop = ("0", bounds[0]) if len(bounds) == 1 else bounds[:2]
        if len(bounds) < 3:
            return node.target.id, start, stop, "1", False
        return node.target.id, start, stop, bounds[2], is_negative(node.iter.args[2])

    def refuse(self, node: ast.expr | ast.stmt) -> UserError:
        """Return the error of what cannot be translated."""
        return self.routine.refuse(node, f"`{ast.unparse(node)}`")

    @abstractmethod
    def target(self, node: ast.expr) -> str:
        """Return what an assignment sets."""

    @abstractmethod
    def value(self, node: ast.expr) -> str:
        """Return an expression."""

    @abstractmethod
    def exchange(self, pairs: list[tuple[ast.expr, ast.expr]]) -> None:
        """Write assignments of values that are all read before any is set."""

    @abstractmethod
    def loop(self, node: ast.For) -> None:
        """Write a loop over a range."""

    @abstractmethod
    def control(self, node: ast.stmt) -> None:
        """Write any other statement."""
