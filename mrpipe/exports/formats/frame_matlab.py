"""A frame as a MATLAB function with its matrices in a .mat file."""

from __future__ import annotations

from mrpipe.exports import matlab_text
from mrpipe.exports.contract import ExportFormat, Files, Subject
from mrpipe.exports.frame import DiscreteFrame


def _files(subject: Subject) -> Files:
    discrete: DiscreteFrame = subject.model
    prefix, frame = subject.prefix, discrete.frame
    model = {
        "mass": frame.mass,
        "damping": frame.damping,
        "stiffness": frame.stiffness,
        "influence": frame.ground_influence,
        "position_of_damper": discrete.position,
        "sample_time_s": discrete.sample_time_s,
        "transition": discrete.transition,
        "input": discrete.input,
        "acceleration_of_state": discrete.acceleration_of_state,
        "acceleration_of_input": discrete.acceleration_of_input,
    }
    main = f"""\
function [state, acceleration] = {prefix}(state, ground_acceleration, damper_force)
% Structure with {frame.floors} degrees of freedom; written by mrpipe, see README.md.
%   state = {prefix}()        state at rest: displacements [m] and velocities [m/s] relative to the ground
%   [state, acceleration] = {prefix}(state, ground_acceleration, damper_force)
% advances by {discrete.sample_time_s!r} s with a constant ground acceleration [m/s^2] and damper force [N], positive
% where it resists. acceleration: absolute accelerations of the floors [m/s^2] at the beginning of the sample.
    persistent model
    if isempty(model)
        model = load('{prefix}.mat');
    end
    if nargin == 0
        state = zeros({2 * frame.floors}, 1);
        acceleration = zeros({frame.floors}, 1);
        return;
    end
    given = [ground_acceleration; damper_force];
    acceleration = model.acceleration_of_state * state + model.acceleration_of_input * given;
    state = model.transition * state + model.input * given;
end
"""
    return {
        f"{prefix}.m": main,
        f"{prefix}.mat": matlab_text.data_file(model, subject.vectors),
        "self_test.m": matlab_text.self_test(
            prefix,
            (f"state = {prefix}();",),
            (
                "before = state;",
                f"[state, acceleration] = {prefix}(state, input(1), input(2));",
                "output = [before; acceleration].';",
            ),
        ),
    }


FORMAT = ExportFormat(
    kind="frame",
    name="matlab",
    files=_files,
    usage="## MATLAB\n\n" + matlab_text.MATLAB_USAGE + "\n\n"
    "`state = {prefix}()` is the state at rest, `[state, acceleration] = {prefix}(state, ground_acceleration, "
    "damper_force)` the next sample.",
)
