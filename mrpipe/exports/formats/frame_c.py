"""A frame as C99: its matrices and the exact step for inputs that are constant over a sample."""

from __future__ import annotations

from mrpipe.exports import c_text
from mrpipe.exports.contract import ExportFormat, Files, Subject
from mrpipe.exports.frame import DiscreteFrame


def _files(subject: Subject) -> Files:
    prefix, upper = subject.prefix, subject.prefix.upper()
    return {
        f"{subject.name}.h": _header(subject),
        f"{subject.name}.c": _source(subject),
        "self_test.c": c_text.self_test(
            f"{subject.name}.h",
            prefix,
            subject.vectors,
            (f"{prefix}_real state[{upper}_STATE_SIZE] = {{0}};",),
            (
                f"for (int place = 0; place < {upper}_STATE_SIZE; ++place) output[place] = state[place];",
                f"{prefix}_step(state, input[0], input[1], output + {upper}_STATE_SIZE);",
            ),
        ),
    }


def _header(subject: Subject) -> str:
    discrete: DiscreteFrame = subject.model
    prefix, upper, n = subject.prefix, subject.prefix.upper(), discrete.frame.floors
    real = f"{prefix}_real"
    return f"""\
/* Structure with {n} degrees of freedom: {", ".join(discrete.frame.names)}. Written by mrpipe; see README.md. */
#ifndef {upper}_H
#define {upper}_H

{c_text.precision_header(prefix)}
#define {upper}_FLOORS {n}
#define {upper}_STATE_SIZE {2 * n}
#define {upper}_SAMPLE_TIME_S {discrete.sample_time_s!r}

/* By rows: kg, N s/m, N/m. */
extern const {real} {prefix}_mass[{n * n}], {prefix}_damping[{n * n}], {prefix}_stiffness[{n * n}];

/* Advance by one sample. state: displacements [m] and velocities [m/s] of the floors relative to the ground, zero at
   rest. The ground acceleration [m/s^2] and the damper force [N], positive where it resists, are constant over the
   sample. acceleration: absolute accelerations of the floors [m/s^2] at the beginning of the sample. */
void {prefix}_step({real} state[{upper}_STATE_SIZE], {real} ground_acceleration, {real} damper_force,
                   {real} acceleration[{upper}_FLOORS]);

#endif
"""


def _source(subject: Subject) -> str:
    discrete: DiscreteFrame = subject.model
    prefix, upper = subject.prefix, subject.prefix.upper()
    frame = discrete.frame
    public = "".join(
        f"const double {prefix}_{name}[] = {{\n{c_text.numbers(getattr(frame, name))}\n}};\n\n"
        for name in ("mass", "damping", "stiffness")
    )
    tables = "\n".join(
        c_text.array(name, getattr(discrete, name))
        for name in ("transition", "input", "acceleration_of_state", "acceleration_of_input")
    )
    body = f"""{public}{tables}
void {prefix}_step(double state[{upper}_STATE_SIZE], double ground_acceleration, double damper_force,
                   double acceleration[{upper}_FLOORS])
{{
    double next[{upper}_STATE_SIZE];
    for (int row = 0; row < {upper}_FLOORS; ++row) {{
        const double *given = acceleration_of_input + 2 * row;
        double total = given[0] * ground_acceleration + given[1] * damper_force;
        for (int place = 0; place < {upper}_STATE_SIZE; ++place)
            total += acceleration_of_state[row * {upper}_STATE_SIZE + place] * state[place];
        acceleration[row] = total;
    }}
    for (int row = 0; row < {upper}_STATE_SIZE; ++row) {{
        double total = input[2 * row] * ground_acceleration + input[2 * row + 1] * damper_force;
        for (int place = 0; place < {upper}_STATE_SIZE; ++place)
            total += transition[row * {upper}_STATE_SIZE + place] * state[place];
        next[row] = total;
    }}
    for (int place = 0; place < {upper}_STATE_SIZE; ++place) state[place] = next[place];
}}
"""
    return f"""\
/* Structure, written by mrpipe; see {subject.name}.h. */
#include "{subject.name}.h"

#include <math.h>

{c_text.precision_macros(prefix)}
{c_text.in_either_precision(body, prefix)}"""


FORMAT = ExportFormat(
    kind="frame",
    name="c",
    files=_files,
    usage="## C\n\n" + c_text.CC_USAGE + "\n\nCall `{prefix}_step` once a sample with a state of zeros at first.",
)
