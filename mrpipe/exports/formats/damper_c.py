"""A damper as C99: the steps of its chain, translated, and the function that advances them."""

from __future__ import annotations

from mrpipe.dampers import plant
from mrpipe.dampers.model import DamperModel
from mrpipe.dampers.plant import in_order
from mrpipe.exports import c_text
from mrpipe.exports.contract import ExportFormat, Files, Subject
from mrpipe.exports.damper import smallest_interval
from mrpipe.exports.translation.c import c_functions, helpers_of, literal
from mrpipe.exports.translation.routines import routines_of

_ADVANCE = """\
{real} {prefix}_force({real} *state, {real} displacement, {real} velocity, {real} acceleration, {real} drive, {real} dt)
{{
    double wire[{WIRE_SIZE}] = {{0.0}}, *memory = state + {memory};
    const int first = memory[{extra}] < 0.5;
    if (first) {{
        for (int index = 0; index < {BOOKKEEPING}; ++index) memory[index] = 0.0;
        memory[4] = velocity;
    }} else {{
        const double speed = fabs(velocity);
        double speed_before = fabs(memory[4]), since = dt;
        if (velocity * memory[4] < 0.0) {{
            since *= speed / (speed + speed_before);
            speed_before = 0.0;
            memory[1] = 0.0;
            memory[2] = 0.0;
        }}
        memory[1] += 0.5 * (speed_before + speed) * since;
        memory[2] += since;
        memory[4] = speed > 0.0 ? velocity : copysign({RESTING}, memory[4]);
    }}
    memory[{extra} + 1] = first ? 0.0 : memory[{extra} + 1] + dt;
    wire[{TIME}] = memory[{extra} + 1];
    wire[{FIRST}] = first ? 1.0 : 0.0;
    wire[{DISPLACEMENT}] = displacement;
    wire[{VELOCITY}] = velocity;
    wire[{ACCELERATION}] = acceleration;
    wire[{DRIVE}] = drive;
    wire[{CURRENT}] = drive;
    wire[{FORCE}] = memory[5];
    wire[{WORK}] = memory[0];
    wire[{SLIP}] = memory[1];
    wire[{SINCE_REVERSAL}] = memory[2];
    wire[{PAST_CURRENT}] = memory[3];
    wire[{RATE_YIELD}] = 1.0;
{calls}
    memory[0] += (wire[{HYSTERETIC_FORCE}] + wire[{VISCOUS_FORCE}]) * wire[{VELOCITY}] * dt;
    memory[3] = max_real(memory[3], fabs(wire[{CURRENT}]));
    memory[5] = wire[{FORCE}];
    memory[{extra}] = 1.0;
    return wire[{FORCE}];
}}
"""
"""The same arithmetic as :func:`mrpipe.dampers.plant.advance`; a mark of the first call and the
time stand behind its bookkeeping."""


def _files(subject: Subject) -> Files:
    damper: DamperModel = subject.model
    size = damper.chain().state_size + plant.BOOKKEEPING + 2
    prefix = subject.prefix
    interval = literal(subject.vectors.sample_time_s)
    return {
        f"{subject.name}.h": _header(subject, damper, size),
        f"{subject.name}.c": _source(subject, damper),
        "self_test.c": c_text.self_test(
            f"{subject.name}.h",
            prefix,
            subject.vectors,
            (f"{prefix}_real state[{prefix.upper()}_STATE_SIZE];", f"{prefix}_reset(state);"),
            (f"output[0] = {prefix}_force(state, input[0], input[1], input[2], input[3], ({prefix}_real){interval});",),
        ),
    }


def _header(subject: Subject, damper: DamperModel, size: int) -> str:
    prefix, upper = subject.prefix, subject.prefix.upper()
    real = f"{prefix}_real"
    effects = ", ".join(item.name for item in damper.effects if not item.sensor) or "none"
    return f"""\
/* MR damper of form {damper.form}; effects: {effects}. Written by mrpipe; see README.md. */
#ifndef {upper}_H
#define {upper}_H

{c_text.precision_header(prefix)}
#define {upper}_STATE_SIZE {size}
#define {upper}_SMALLEST_INTERVAL_S {literal(smallest_interval(damper.chain()))} /* of the calls; 0: any */

/* Set the memory to zero before the first call. */
void {prefix}_reset({real} state[{upper}_STATE_SIZE]);

/* Return the damper force [N] at the next sample: displacement [m], velocity [m/s], acceleration [m/s^2], drive
   [{damper.drive_unit}], interval since the sample before [s]. The force is positive where it resists a positive
   velocity. */
{real} {prefix}_force({real} *state, {real} displacement, {real} velocity, {real} acceleration, {real} drive,
    {real} dt);

#endif
"""


def _source(subject: Subject, damper: DamperModel) -> str:
    prefix = subject.prefix
    steps = in_order(damper.steps())
    routines = routines_of(dict.fromkeys(step.function for step in steps))
    by_function = {routine.python: routine for routine in routines}
    tables, calls, at = [], [], 0
    for place, step in enumerate(steps):
        routine = by_function[step.function.py_func]
        table = f"numbers_{place + 1}"
        tables.append(f"/* {step.name} */\n{c_text.array(table, step.parameters)}")
        sizes = {"wire": plant.WIRE_SIZE, "state": step.state_size, "parameters": len(step.parameters)}
        given = dict(zip(routine.arguments, ("wire", f"state + {at}", table, "dt"), strict=True))
        lengths = dict(zip(routine.arguments, (*sizes.values(), 0), strict=True))
        arguments = [
            text
            for name, value in given.items()
            for text in ((value, str(lengths[name])) if name in routine.measured else (value,))
        ]
        calls.append(f"    {routine.name}({', '.join(arguments)}); /* {step.name} */")
        at += step.state_size
    places = {
        name: getattr(plant, name) for name in vars(plant) if name.isupper() and isinstance(getattr(plant, name), int)
    }
    advance = _ADVANCE.format(
        **places,
        RESTING=plant.RESTING,
        real="double",
        prefix=prefix,
        memory=at,
        extra=plant.BOOKKEEPING,
        calls="\n".join(calls),
    )
    reset = f"""\
void {prefix}_reset(double state[{prefix.upper()}_STATE_SIZE])
{{
    for (int index = 0; index < {prefix.upper()}_STATE_SIZE; ++index) state[index] = 0.0;
}}
"""
    body = "\n".join([*tables, c_functions(routines), reset, advance])
    body = f"{helpers_of(body)}\n{body}"
    return f"""\
/* MR damper, written by mrpipe; see {subject.name}.h. The functions are translated from the steps of the model. */
#include "{subject.name}.h"

#include <math.h>

{c_text.precision_macros(prefix)}
{c_text.in_either_precision(body, prefix)}"""


FORMAT = ExportFormat(
    kind="damper",
    name="c",
    files=_files,
    usage="## C\n\n" + c_text.CC_USAGE + "\n\n"
    "Call `{prefix}_reset` once, then `{prefix}_force` at every sample. The interval may change from call to call.",
)
