"""YAML with line numbers, and messages that name the line and the nearest known key.

A file is read by the safe loader only, and what a hostile or damaged file can do is bounded: aliases may not multiply
without limit, nesting is limited, and dates stay text, so that `2026-30-01` is a name and not an error.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar, get_args

import yaml
from pydantic import BaseModel, ValidationError

from mrpipe.errors import UserError
from mrpipe.words import counted

Place = tuple[str | int, ...]
Model = TypeVar("Model", bound=BaseModel)

MOST_NODES = 300_000
"""Largest number of keys and values of a file, aliases written out."""

DEEPEST = 60
"""Deepest nesting."""

LARGEST_BYTES = 20_000_000
"""Largest file."""

_LONGEST_SHOWN = 80
KINDS = {"str", "int", "float", "bool"}
"""Names by which pydantic distinguishes the types of a value that may have several."""


def closest(word: str, known: Iterable[str]) -> str:
    """Return the known word that a misspelt one most probably means; empty if none is close."""
    words = sorted(known)
    # the case of a unit matters, but its misspelling often is the case alone
    folded = {item.casefold(): item for item in words}
    if str(word).casefold() in folded:
        return folded[str(word).casefold()]
    close = difflib.get_close_matches(str(word), words, n=len(words) or 1, cutoff=0.5)
    # of equally close words, the first letter is rarely the wrong one: `Fx` is F and not x
    unlike = {item: -difflib.SequenceMatcher(a=item, b=str(word)).ratio() for item in close}
    close.sort(key=lambda item: (unlike[item], item[0].casefold() != str(word)[0].casefold(), item))
    # of words that are about equally close, letters in another order are the likeliest mistake
    turned = [item for item in close if sorted(item.casefold()) == sorted(str(word).casefold())]
    return next(iter(turned or close), "")


def nearest(word: str, known: Iterable[str]) -> str:
    """Return a remedy that names the known words, the likeliest first."""
    words = sorted(known)
    likeliest = closest(word, words)
    if likeliest:
        return f"did you mean {likeliest}?"
    return f"known: {', '.join(words)}" if words else "there are none"


def shown(value: Any) -> str:
    """Return a value of the user for a message, with the words of YAML; long values are shortened."""
    if value is None:
        return "empty"
    if isinstance(value, bool):
        return str(value).lower()
    text = repr(value) if not isinstance(value, int) or abs(value) < 10**30 else "a number of more than 30 digits"
    return text if len(text) <= _LONGEST_SHOWN else f"{text[: _LONGEST_SHOWN - 4]} ..."


def dotted(place: Place) -> str:
    """Return `tests[3].role` for a place such as `("tests", 3, "role")`."""
    text = ""
    for part in place:
        text += f"[{part}]" if isinstance(part, int) else f"{'.' if text else ''}{part}"
    return text


@dataclass(frozen=True)
class YamlSource:
    """A YAML file: its content, and on which line each key stands."""

    path: Path
    content: dict[str, Any]
    lines: Mapping[Place, int] = field(default_factory=dict)

    def where(self, place: Place) -> str:
        """Return `line 12, tests[3].role` for a place such as `("tests", 3, "role")`."""
        text = dotted(place)
        for length in range(len(place), 0, -1):
            if place[:length] in self.lines:
                return f"line {self.lines[place[:length]]}, {text}"
        return text

    def error(self, place: Place, problem: str, remedy: str) -> UserError:
        """Return the error that names this file and place."""
        return UserError(self.path, self.where(place), problem, remedy)

    def build(self, model: type[Model], content: Any, place: Place) -> Model:
        """Validate `content` as `model`; the first fault is reported with its line.

        Raises
        ------
        UserError
            If a key is unknown (with the nearest known one), missing, or its value does not fit.
        """
        if not isinstance(content, Mapping):
            raise self.error(place, f"is {shown(content)}", "a mapping of keys to values expected")
        try:
            return model.model_validate({str(key): value for key, value in content.items()})
        except ValidationError as error:
            first = sorted(error.errors(), key=lambda item: item["type"] != "extra_forbidden")[0]
            key = (*place, *_keys(model, first["loc"]))
            if first["type"] == "extra_forbidden":
                known = _model_at(model, first["loc"][:-1]).model_fields
                raise self.error(key, "unknown key", nearest(str(first["loc"][-1]), known)) from None
            if first["type"] == "missing":
                raise self.error(key, "is missing", f"write {first['loc'][-1]}: ... here") from None
            raise self.error(key, f"is {shown(first['input'])}", expected(first)) from None


def _keys(model: type[BaseModel], place: Place) -> tuple[str | int, ...]:
    """Return the keys of a fault as the user writes them, without the names of the types that a value may have."""
    keys = tuple(part for part in place if part != "[key]")
    of_union = len(keys) > 1 and keys[-1] in KINDS and keys[-1] not in _model_at(model, keys[:-2]).model_fields
    return keys[:-1] if of_union else keys


def _model_at(model: type[BaseModel], place: Place) -> type[BaseModel]:
    """Return the model at a place within a model; keys of a plain mapping and indices are passed over."""
    for part in place:
        entry = model.model_fields.get(part) if isinstance(part, str) else None
        model = (entry and _model_within(entry.annotation)) or model
    return model


def _model_within(annotation: Any) -> type[BaseModel] | None:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    return next((found for item in get_args(annotation) if (found := _model_within(item)) is not None), None)


def expected(fault: Mapping[str, Any]) -> str:
    """Return in plain words what one fault that pydantic found should have been."""
    kind, context = fault["type"], fault.get("ctx", {})
    if kind == "literal_error":
        words = [word.strip(" '") for word in str(context["expected"]).replace(" or ", ", ").split(",")]
        close = difflib.get_close_matches(str(fault["input"]), words, n=1, cutoff=0.5)
        hint = f"did you mean {close[0]}? " if close else ""
        return f"{hint}{context['expected']} expected"
    if kind == "too_long":
        return f"a list of at most {context['max_length']} values expected"
    if kind == "too_short":
        least = int(context.get("min_length", 1))
        return f"a list of at least {counted(least, 'value')} expected"
    plain = {
        "string_pattern_mismatch": "a name of letters, digits and _ expected, which does not begin with a digit",
        "finite_number": "a finite number expected",
        "float_parsing": "a number expected",
        "float_type": "a number expected",
        "int_parsing": "a whole number expected",
        "int_type": "a whole number expected",
        "int_from_float": "a whole number expected",
        "string_type": "a text expected" + ("" if isinstance(fault["input"], list | dict) else "; put it in quotes"),
        "string_too_short": "a text that is not empty expected",
        "bool_parsing": "true or false expected",
        "bool_type": "true or false expected",
        "dict_type": "a mapping of keys to values expected",
        "model_type": "a mapping of keys to values expected",
        "list_type": "a list expected, as in [a, b]",
        "tuple_type": "a list expected, as in [a, b]",
    }
    said = str(fault["msg"]).removeprefix("Value error, ")
    if kind in {"float_parsing", "int_parsing"} and _COMMA.match(str(fault.get("input"))):
        return f"{plain[kind]}; write a decimal point, as in {str(fault['input']).replace(',', '.')}"
    limit = said.removeprefix("Input should be ")
    if limit.startswith(("greater", "less")):
        return f"a value {limit} expected"
    return plain.get(kind, said[:1].lower() + said[1:] if said.startswith("Input") else said)


class _Loader(yaml.SafeLoader):
    """The safe loader without dates, octal numbers and numbers to the base 60: 0123 and 10:30 are names."""


class _FastLoader(getattr(yaml, "CSafeLoader", yaml.SafeLoader)):  # type: ignore[misc]
    """The same with the parser of libyaml, where PyYAML has it: about ten times faster."""


_COMMA = re.compile(r"^\s*[-+]?\d+,\d+\s*$")
_WHOLE = re.compile(r"^(?:[-+]?(?:0|[1-9][0-9_]*)|0x[0-9a-fA-F_]+)$")
_DECIMAL = re.compile(r"^(?:[-+]?(?:[0-9][0-9_]*)\.[0-9_]*(?:[eE][-+][0-9]+)?|[-+]?\.[0-9][0-9_]*(?:[eE][-+][0-9]+)?"
                      r"|[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN))$")  # fmt: skip
_NUMBERS = {"tag:yaml.org,2002:int": _WHOLE, "tag:yaml.org,2002:float": _DECIMAL}

_RESOLVERS = {
    letter: [(tag, _NUMBERS.get(tag, pattern)) for tag, pattern in resolvers if tag != "tag:yaml.org,2002:timestamp"]
    for letter, resolvers in yaml.SafeLoader.yaml_implicit_resolvers.items()
}
_Loader.yaml_implicit_resolvers = _RESOLVERS
_FastLoader.yaml_implicit_resolvers = _RESOLVERS


def read_yaml(path: Path) -> YamlSource:
    """Read a YAML mapping with the safe loader only.

    Raises
    ------
    UserError
        If the file is missing, not YAML, no mapping, holds a key twice, or is nested or multiplied without measure.
    """
    path = Path(path)
    try:
        if path.stat().st_size > LARGEST_BYTES:
            raise UserError(path, "", f"is larger than {LARGEST_BYTES // 1_000_000} MB", "name a YAML file")
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise UserError(path, "", "cannot be read", "name a YAML file that is there") from error
    except UnicodeDecodeError as error:
        raise UserError(path, "", "is not UTF-8 text", "save it as UTF-8") from error
    node, content = parse(text, path)
    if content is None:
        raise UserError(path, "", "is empty", "write `key: value` lines")
    if not isinstance(content, dict):
        raise UserError(path, "line 1", "is not a mapping", "write `key: value` lines")
    lines: dict[Place, int] = {}
    _collect_lines(node, (), lines, path)
    return YamlSource(path, content, lines)


def parse(text: str, source: str | Path) -> tuple[Any, Any]:
    """Return the tree of nodes of a YAML text and its content as plain Python.

    Raises
    ------
    UserError
        If the text is not valid YAML, or is nested or multiplied without measure; `source` names it.
    """
    try:
        try:
            return _parse_with(_FastLoader, text, source)
        except yaml.YAMLError:
            # the messages of PyYAML's own parser name the character that is wrong
            return _parse_with(_Loader, text, source)
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        where = f"line {mark.line + 1}" if mark else ""
        problem = getattr(error, "problem", None) or str(error).splitlines()[0]
        if "'\\t'" in problem:
            raise UserError(source, where, "not valid YAML (a tab)", "write spaces in place of the tab") from error
        raise UserError(source, where, f"not valid YAML ({problem})", "correct the syntax") from error
    except RecursionError:
        raise UserError(source, "", "is nested too deeply", f"nest at most {DEEPEST} levels") from None
    except (ValueError, KeyError, TypeError, OverflowError, AttributeError) as error:
        problem = str(error).splitlines()[0] if str(error) else type(error).__name__
        remedy = "write plain values without tags such as !!int"
        raise UserError(source, "", f"a value cannot be read ({problem[:120]})", remedy) from error


def _parse_with(loader: type[Any], text: str, source: str | Path) -> tuple[Any, Any]:
    node = yaml.compose(text, Loader=loader)
    if node is not None:
        _require_measure(node, source)
    # construction changes the tree when it merges mappings, so it gets a copy of the tree
    return node, yaml.load(text, Loader=loader)


def _require_measure(root: Any, source: str | Path) -> None:
    """Refuse trees that contain themselves, are nested too deeply, or grow beyond measure when aliases are written out.

    The size of each node is counted once, however often aliases refer to it.
    """
    sizes: dict[int, int] = {}
    open_nodes: set[int] = set()

    def size_of(node: Any, depth: int) -> int:
        if isinstance(node, yaml.ScalarNode):
            return 1
        line = f"line {node.start_mark.line + 1}"
        if id(node) in open_nodes:
            raise UserError(source, line, "an alias refers to a mapping that contains it", "write the values out")
        if depth > DEEPEST:
            raise UserError(source, line, "is nested too deeply", f"nest at most {DEEPEST} levels")
        if id(node) not in sizes:
            open_nodes.add(id(node))
            inner = (
                node.value if isinstance(node, yaml.SequenceNode) else [item for pair in node.value for item in pair]
            )
            sizes[id(node)] = 1 + sum(size_of(item, depth + 1) for item in inner)
            open_nodes.discard(id(node))
        if sizes[id(node)] > MOST_NODES:
            remedy = f"write at most {MOST_NODES} keys and values, aliases written out"
            raise UserError(source, line, "holds too many values", remedy)
        return sizes[id(node)]

    size_of(root, 0)


def _collect_lines(node: Any, place: Place, lines: dict[Place, int], path: Path) -> None:
    if isinstance(node, yaml.MappingNode):
        for key, value in node.value:
            inner = (*place, str(key.value))
            line = key.start_mark.line + 1
            if inner in lines:
                dotted = ".".join(str(part) for part in inner)
                problem = f"appears already in line {lines[inner]}"
                raise UserError(path, f"line {line}, {dotted}", problem, "keep one of the two")
            lines[inner] = line
            _collect_lines(value, inner, lines, path)
    elif isinstance(node, yaml.SequenceNode):
        for index, value in enumerate(node.value):
            inner_index: Place = (*place, index)
            lines[inner_index] = value.start_mark.line + 1
            _collect_lines(value, inner_index, lines, path)
