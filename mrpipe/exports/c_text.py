"""Parts that the C files of all exports share: both precisions from one source, tables of numbers, self test."""

from __future__ import annotations

import re
from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike

from mrpipe.exports.contract import DOUBLE_LIMIT, Vectors
from mrpipe.exports.translation.c import literal
from mrpipe.exports.translation.routines import MATHEMATICS

_LARGEST_SINGLE, _SMALLEST_SINGLE = 3.4e38, 1.2e-38
_TOKENS = re.compile(
    r"(?P<comment>/\*.*?\*/)|(?P<directive>^[ \t]*#[^\n]*)|(?P<text>\"[^\"\n]*\")"
    r"|(?P<number>(?<![\w.])(?:0[xX][0-9a-fA-F]*\.?[0-9a-fA-F]*[pP][+-]?\d+|\d+\.\d*(?:[eE][+-]?\d+)?|\d+[eE][+-]?\d+))"
    r"|(?P<word>\b[A-Za-z_]\w*\b)",
    re.DOTALL | re.MULTILINE,
)

CC_USAGE = """\
Build with `cc -std=c99 -c {name}.c` and link `-lm`. Define the macro `{upper}_SINGLE` for single
precision (`float`); else the numbers are `double`. A compiler that contracts `a*b+c` (some do by default) changes the
last digits, which `-ffp-contract=off` avoids.

`cc -std=c99 {name}.c self_test.c -lm` builds a program that compares the C code with the test vectors and returns 0
where they agree."""


def precision_header(prefix: str) -> str:
    """Return the declaration of the type `<prefix>_real`: double, or float where `<PREFIX>_SINGLE` is defined."""
    upper = prefix.upper()
    return f"""\
/* Type of all numbers: double, or float where {upper}_SINGLE is defined. */
#ifdef {upper}_SINGLE
typedef float {prefix}_real;
#else
typedef double {prefix}_real;
#endif
"""


def precision_macros(prefix: str) -> str:
    """Return the macros for constants and mathematical functions in either precision."""
    return f"""\
#ifdef {prefix.upper()}_SINGLE
#define R(number) number##f
#define M(function) function##f
#define BIG(number) 1e30f
#else
#define R(number) number
#define M(function) function
#define BIG(number) number
#endif
"""


def in_either_precision(text: str, prefix: str) -> str:
    """Return C text for double precision in the type `<prefix>_real`.

    Constants become `R(0.5)` and mathematical functions `M(tanh)`, so that code in single precision contains no
    arithmetic in double precision. Comments, strings and preprocessor lines stay as they are.
    """

    def changed(match: re.Match[str]) -> str:
        number, word = match.group("number"), match.group("word")
        if number is not None:
            return _number(number)
        if word == "double":
            return f"{prefix}_real"
        if word in MATHEMATICS or word == "fabs":
            return f"M({word})"
        return match.group(0)

    return _TOKENS.sub(changed, text)


def _number(text: str) -> str:
    value = float.fromhex(text) if text[:2] in ("0x", "0X") else float(text)
    if abs(value) > _LARGEST_SINGLE:
        # it stays finite in either precision, because a product of infinity and zero is not a number
        return f"BIG({text})"
    # beyond the range of float the compiler rounds, without a warning because of the cast
    return f"R({text})" if value == 0.0 or abs(value) > _SMALLEST_SINGLE else f"(float){text}"


def numbers(values: ArrayLike, *, per_line: int = 4, indent: str = "    ") -> str:
    """Return numbers as the inner part of a C initialiser."""
    flat = [literal(float(value)) for value in np.ravel(np.asarray(values, dtype=np.float64))]
    lines = [", ".join(flat[start : start + per_line]) for start in range(0, len(flat), per_line)]
    return ",\n".join(indent + line for line in lines) or f"{indent}0.0"


def array(name: str, values: ArrayLike) -> str:
    """Return the definition of a constant array."""
    return f"static const double {name}[] = {{\n{numbers(values)}\n}};\n"


def self_test(header: str, prefix: str, vectors: Vectors, setup: Iterable[str], call: Iterable[str]) -> str:
    """Return a program that compares C code with test vectors.

    Parameters
    ----------
    header
        Header of the code.
    prefix
        First part of its names.
    vectors
        Inputs and expected outputs.
    setup
        Statements before the first row.
    call
        Statements that compute `output[]` from `input[]`, both of the type of the code.
    """
    upper, inputs, outputs = prefix.upper(), vectors.input_table, vectors.output_table
    flags = ", ".join(str(int(item.flag)) for item in vectors.outputs)
    rows = "\n".join(
        "    {{" + ", ".join(map(literal, left)) + "}, {" + ", ".join(map(literal, right)) + "}},"
        for left, right in zip(inputs.tolist(), outputs.tolist(), strict=True)
    )
    before, body = (
        "\n".join(f"{indent}{line}" for line in lines) for indent, lines in (("    ", setup), ("        ", call))
    )
    return f"""\
/* Compares {header} with the test vectors of vectors.csv; returns 0 where they agree. */
#include "{header}"

#include <math.h>
#include <stdio.h>

#define INPUTS {inputs.shape[1]}
#define OUTPUTS {outputs.shape[1]}
#define ROWS {len(inputs)}
#ifdef {upper}_SINGLE
#define LIMIT {vectors.single_limit!r}
/* 1 for a state, such as clipped or not, of which the share of rows that differ counts */
static const int flag[OUTPUTS] = {{{flags}}};
#else
#define LIMIT {DOUBLE_LIMIT!r}
#endif

static const struct {{ double input[INPUTS], output[OUTPUTS]; }} rows[ROWS] = {{
{rows}
}};

int main(void)
{{
    {prefix}_real input[INPUTS], output[OUTPUTS];
    double largest[OUTPUTS] = {{0.0}}, deviation[OUTPUTS] = {{0.0}}, worst = 0.0;
{before}
    for (int row = 0; row < ROWS; ++row) {{
        for (int place = 0; place < INPUTS; ++place) input[place] = ({prefix}_real)rows[row].input[place];
{body}
        for (int place = 0; place < OUTPUTS; ++place) {{
            const double expected = rows[row].output[place], difference = fabs((double)output[place] - expected);
            if (fabs(expected) > largest[place]) largest[place] = fabs(expected);
#ifdef {upper}_SINGLE
            /* a result that is not a number counts as a deviation */
            deviation[place] += flag[place] ? !(difference < 0.5) / (double)ROWS : difference * difference / ROWS;
#else
            /* a result that is not a number counts as a deviation */
            if (!(difference <= deviation[place])) deviation[place] = difference;
#endif
        }}
    }}
    for (int place = 0; place < OUTPUTS; ++place) {{
#ifdef {upper}_SINGLE
        /* RMS, because rounding may move a switch by one sample */
        if (flag[place])
            largest[place] = 1.0;
        else
            deviation[place] = sqrt(deviation[place]);
#endif
        const double share = deviation[place] / (largest[place] > 0.0 ? largest[place] : 1.0);
        if (!(share <= worst)) worst = share;
    }}
    printf("largest deviation %.3e of the largest magnitude, limit %.0e\\n", worst, (double)LIMIT);
    return worst <= LIMIT ? 0 : 1;
}}
"""
