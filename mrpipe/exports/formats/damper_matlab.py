"""A damper as a MATLAB function with its numbers in a .mat file."""

from __future__ import annotations

from mrpipe.dampers import plant
from mrpipe.dampers.model import DamperModel
from mrpipe.dampers.plant import in_order
from mrpipe.exports import matlab_text
from mrpipe.exports.contract import ExportFormat, Files, Subject
from mrpipe.exports.translation.matlab import matlab_functions, number
from mrpipe.exports.translation.routines import routines_of

_MAIN = """\
function [force, state] = {prefix}(state, displacement, velocity, acceleration, drive, dt)
% MR damper of form {form}; written by mrpipe, see README.md.
%   state = {prefix}()                      memory at the start
%   [force, state] = {prefix}(state, displacement, velocity, acceleration, drive, dt)
% displacement [m], velocity [m/s], acceleration [m/s^2], drive [{unit}], interval dt [s], force [N].
    persistent numbers
    if isempty(numbers)
        numbers = load('{prefix}.mat');
    end
    if nargin == 0
        force = zeros({size}, 1);
        return;
    end
    wire = zeros({WIRE_SIZE}, 1);
    first = state({at} + {BOOKKEEPING} + 1) < 0.5;
    if first
        state({at} + 1:{at} + {BOOKKEEPING}) = 0;
        state({at} + 5) = velocity;
    else
        speed = abs(velocity);
        speed_before = abs(state({at} + 5));
        since = dt;
        if velocity * state({at} + 5) < 0
            since = dt * speed / (speed + speed_before);
            speed_before = 0;
            state({at} + 2) = 0;
            state({at} + 3) = 0;
        end
        state({at} + 2) = state({at} + 2) + 0.5 * (speed_before + speed) * since;
        state({at} + 3) = state({at} + 3) + since;
        if speed > 0
            state({at} + 5) = velocity;
        elseif state({at} + 5) < 0
            state({at} + 5) = -{RESTING};
        else
            state({at} + 5) = {RESTING};
        end
    end
    if first
        state({at} + {BOOKKEEPING} + 2) = 0;
    else
        state({at} + {BOOKKEEPING} + 2) = state({at} + {BOOKKEEPING} + 2) + dt;
    end
    wire({TIME} + 1) = state({at} + {BOOKKEEPING} + 2);
    wire({FIRST} + 1) = double(first);
    wire({DISPLACEMENT} + 1) = displacement;
    wire({VELOCITY} + 1) = velocity;
    wire({ACCELERATION} + 1) = acceleration;
    wire({DRIVE} + 1) = drive;
    wire({CURRENT} + 1) = drive;
    wire({FORCE} + 1) = state({at} + 6);
    wire({WORK} + 1) = state({at} + 1);
    wire({SLIP} + 1) = state({at} + 2);
    wire({SINCE_REVERSAL} + 1) = state({at} + 3);
    wire({PAST_CURRENT} + 1) = state({at} + 4);
    wire({RATE_YIELD} + 1) = 1;
{calls}
    power = (wire({HYSTERETIC_FORCE} + 1) + wire({VISCOUS_FORCE} + 1)) * wire({VELOCITY} + 1);
    state({at} + 1) = state({at} + 1) + power * dt;
    state({at} + 4) = max(state({at} + 4), abs(wire({CURRENT} + 1)));
    state({at} + 6) = wire({FORCE} + 1);
    state({at} + {BOOKKEEPING} + 1) = 1;
    force = wire({FORCE} + 1);
end
"""


def _files(subject: Subject) -> Files:
    damper: DamperModel = subject.model
    prefix = subject.prefix
    steps = in_order(damper.steps())
    routines = routines_of(dict.fromkeys(step.function for step in steps))
    by_function = {routine.python: routine for routine in routines}
    tables, calls, at = {}, [], 0
    for place, step in enumerate(steps):
        routine = by_function[step.function.py_func]
        tables[f"step_{place + 1}"] = step.parameters if len(step.parameters) else [0.0]
        given = dict(
            zip(
                routine.arguments,
                ("wire", f"state({at + 1}:{at + step.state_size})", f"numbers.step_{place + 1}", "dt"),
                strict=True,
            )
        )
        changed = [given[name] for name in routine.arguments if name in routine.written]
        left = f"[{', '.join(changed)}] = " if changed else ""
        calls.append(f"    {left}{routine.name}({', '.join(given.values())}); % {step.name}")
        at += step.state_size
    places = {
        name: getattr(plant, name) for name in vars(plant) if name.isupper() and isinstance(getattr(plant, name), int)
    }
    main = _MAIN.format(
        **places,
        RESTING=plant.RESTING,
        prefix=prefix,
        form=damper.form,
        unit=damper.drive_unit,
        size=at + plant.BOOKKEEPING + 2,
        at=at,
        calls="\n".join(calls),
    )
    interval = number(subject.vectors.sample_time_s)
    return {
        f"{prefix}.m": f"{main}\n{matlab_functions(routines)}",
        f"{prefix}.mat": matlab_text.data_file(tables, subject.vectors),
        "self_test.m": matlab_text.self_test(
            prefix,
            (f"state = {prefix}();",),
            (f"[output, state] = {prefix}(state, input(1), input(2), input(3), input(4), {interval});",),
        ),
    }


FORMAT = ExportFormat(
    kind="damper",
    name="matlab",
    files=_files,
    usage="## MATLAB\n\n" + matlab_text.MATLAB_USAGE + "\n\n"
    "`state = {prefix}()` is the memory at the start, `[force, state] = {prefix}(state, x, v, a, drive, dt)` the next "
    "sample.",
)
