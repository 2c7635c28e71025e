"""The controller as C99 and JSON for a real-time target; the same arithmetic as :mod:`mrpipe.control.kernel`."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.control import kernel
from mrpipe.control.controller import Controller
from mrpipe.control.law import Law
from mrpipe.control.laws import law_named
from mrpipe.exports import c_text
from mrpipe.exports.contract import Channel, Vectors

LOADS_FROM = ("mrpipe/exports/controller_template.c",)
"""Files of the program that are read at run time: they belong to the code version of a stage."""
_TEMPLATE = Path(__file__).with_name("controller_template.c")

_MACROS = (
    "MEASURED_DISPLACEMENT",
    "MEASURED_ACCELERATION",
    "MEASURED_VELOCITY",
    "MEASURED_GROUND",
    "MEASURED_FORCE",
    "MEASURED_FLOORS",
    "COMMAND_DRIVE",
    "COMMAND_FORCE",
    "COMMAND_UNCLIPPED",
    "COMMAND_DISPLACEMENT",
    "COMMAND_VELOCITY",
    "COMMAND_AMPLITUDE",
    "COMMAND_CLIPPED",
    "COMMAND_SWITCHED",
    "COMMAND_INVERSE",
    "COMMAND_FAULT",
    "COMMAND_SIZE",
)
_INNER_MACROS = tuple(
    name for name in vars(kernel) if name.isupper() and isinstance(getattr(kernel, name), int) and name not in _MACROS
)

DRIVE = "drive"
"""Unit of a quantity that is in the unit of the drive, A or V."""

PARAMETERS: dict[str, tuple[int, str, str]] = {
    "c_n_s_m": (kernel.GAIN_C, "N*s/m", "gain: viscosity"),
    "k_n_m": (kernel.GAIN_K, "N/m", "gain: stiffness"),
    "alpha_n_m": (kernel.GAIN_ALPHA, "N/m", "gain: friction with negative stiffness"),
    "residual_force": (kernel.RESIDUAL_FORCE, "N", "desired force below which the drive is 0"),
    "drive_limit": (kernel.DRIVE_LIMIT, DRIVE, "largest drive"),
    "safe_drive": (kernel.SAFE_DRIVE, DRIVE, "drive while the readings cannot be used"),
    "kalman_displacement": (kernel.KALMAN, "1", "gain of the Kalman filter on the displacement"),
    "kalman_velocity": (kernel.KALMAN + 1, "1/s", "gain of the Kalman filter on the velocity"),
    "kalman_bias": (kernel.KALMAN + 2, "1/s^2", "gain of the Kalman filter on the bias of the accelerometer"),
    "dead_band": (kernel.DEAD_BAND, "m/s", "speed below which the direction of motion is unchanged"),
    "friction_rounding": (kernel.ROUNDING, "m/s", "speed over which friction changes its sign; 0: a jump"),
    "extremum_step": (kernel.EXTREMUM_STEP, "m", "way back that makes an extremum count"),
    "extremum_share": (kernel.EXTREMUM_SHARE, "1", "the same as a share of the amplitude"),
    "extremum_memory": (kernel.MEMORY, "s", "time after which a pending extremum counts"),
    "low_pass_b0": (kernel.LOW_PASS, "1", "low-pass on the drive"),
    "low_pass_b1": (kernel.LOW_PASS + 1, "1", "low-pass on the drive"),
    "low_pass_b2": (kernel.LOW_PASS + 2, "1", "low-pass on the drive"),
    "low_pass_a1": (kernel.LOW_PASS + 3, "1", "low-pass on the drive"),
    "low_pass_a2": (kernel.LOW_PASS + 4, "1", "low-pass on the drive"),
}
"""Named parameters of every controller: place among its numbers, unit and meaning. They may change at run time."""

_GAINS = {"c_n_s_m": "GAIN_C", "k_n_m": "GAIN_K", "alpha_n_m": "GAIN_ALPHA"}
"""Names of the gains in the C code of a law."""

_READINGS = {
    "MEASURED_DISPLACEMENT": "displacement of the damper [m]",
    "MEASURED_ACCELERATION": "acceleration of the damper: that of one end minus that of the other [m/s^2]",
    "MEASURED_VELOCITY": "velocity of the damper [m/s]",
    "MEASURED_GROUND": "absolute acceleration of the ground [m/s^2]",
    "MEASURED_FORCE": "force of the damper by a load cell, positive where it resists the motion [N]",
    "MEASURED_FLOORS": "from here on: absolute acceleration of each floor [m/s^2]",
}

_COMMANDS = {
    "COMMAND_DRIVE": "drive to be held until the next call [drive]",
    "COMMAND_FORCE": "desired force after clipping [N]",
    "COMMAND_UNCLIPPED": "desired force of the law [N]",
    "COMMAND_DISPLACEMENT": "estimated displacement of the damper [m]",
    "COMMAND_VELOCITY": "estimated velocity of the damper [m/s]",
    "COMMAND_AMPLITUDE": "last extremum of the displacement [m]",
    "COMMAND_CLIPPED": "1 where clipping set the force to zero",
    "COMMAND_SWITCHED": "1 where the force is below the residual force, so that the drive is 0",
    "COMMAND_INVERSE": "drive before switch, low-pass and limits [drive]",
    "COMMAND_FAULT": "0; 1 while a refused reading is replaced by the last good one; 2 at the safe drive",
}

VECTOR_ROWS = 400
_FAULT = slice(300, 340)
"""Rows of the test vectors in which the displacement cannot be true."""


def controller_files(controller: Controller, prefix: str, details: dict[str, Any]) -> dict[str, str]:
    """Return file name -> text of the exported folder.

    Parameters
    ----------
    controller
        Controller to export.
    prefix
        Prefix of the C names.
    details
        Further entries of controller.json (where gains come from, units).
    """
    law = law_named(controller.law)
    unit = str(details.get("drive_unit", DRIVE))
    vectors = controller_vectors(controller, float(details.get("stroke_m", 0.01)), unit)
    upper = prefix.upper()
    return {
        "controller.h": _header(controller, prefix, unit),
        "controller.c": c_text.in_either_precision(_source(controller, law, prefix), prefix),
        "controller.json": json.dumps(_description(controller, prefix, unit, details), indent=2) + "\n",
        "vectors.csv": vectors.as_csv(),
        "self_test.c": c_text.self_test(
            "controller.h",
            prefix,
            vectors,
            (
                f"{prefix}_real state[{upper}_STATE_SIZE], command[{upper}_COMMAND_SIZE] = {{0}};",
                f"{prefix}_controller_reset(state);",
            ),
            (
                f"{prefix}_controller_step(state, input, command);",
                "for (int place = 0; place < OUTPUTS; ++place) output[place] = command[place];",
            ),
        ),
        "README.md": _readme(controller, prefix, unit),
    }


def controller_vectors(controller: Controller, stroke_m: float, drive_unit: str = DRIVE) -> Vectors:
    """Return readings of sensors and the commands of the controller in Python.

    The damper moves harmonically, then its motion decays. The readings have a ripple, as measured ones have noise, and
    for a while the displacement is impossible.

    Parameters
    ----------
    controller
        The controller.
    stroke_m
        Largest displacement of the damper [m].
    drive_unit
        Unit of the drive, A or V; `drive` where it is not known.
    """
    time = controller.sample_time_s * np.arange(VECTOR_ROWS)
    omega = 2.0 * np.pi * 0.75 / controller.options.extremum_memory_s
    half = time[VECTOR_ROWS // 2]
    envelope = 0.8 * stroke_m * np.exp(-0.15 * omega * np.maximum(time - half, 0.0))
    x = envelope * np.sin(omega * time)
    measured = np.zeros((VECTOR_ROWS, controller.measured_size))
    ripple = np.sin(61.0 * omega * time + 1.0)
    measured[:, kernel.MEASURED_DISPLACEMENT] = x + 1e-3 * stroke_m * ripple
    measured[:, kernel.MEASURED_ACCELERATION] = -omega * omega * x * (1.0 + 0.01 * ripple)
    measured[:, kernel.MEASURED_VELOCITY] = np.gradient(x, time)
    measured[:, kernel.MEASURED_GROUND] = 0.3 * np.sin(2.3 * omega * time)
    measured[:, kernel.MEASURED_FORCE] = 50.0 * np.tanh(
        measured[:, kernel.MEASURED_VELOCITY] / (0.1 * stroke_m * omega)
    )
    for floor in range(controller.floors):
        share = (floor + 1.0) / controller.floors
        measured[:, kernel.MEASURED_FLOORS + floor] = -omega * omega * x * share + 0.1 * np.cos(
            1.7 * omega * time + floor
        )
    measured[_FAULT, kernel.MEASURED_DISPLACEMENT] = 1e12
    commands = _commands(controller, measured)
    inputs = {place: name for name, place in _places("MEASURED_").items() if place < kernel.MEASURED_FLOORS}
    inputs.update({kernel.MEASURED_FLOORS + floor: f"floor_{floor + 1}" for floor in range(controller.floors)})
    outputs = {place: name for name, place in _places("COMMAND_").items()}
    return Vectors(
        tuple(Channel(name, _UNITS.get(name, "m/s^2"), measured[:, place]) for place, name in sorted(inputs.items())),
        tuple(
            Channel(name, _in_unit(_UNITS.get(name, "1"), drive_unit), commands[:, place], name in _FLAGS)
            for place, name in sorted(outputs.items())
        ),
        controller.sample_time_s,
        single_limit=1e-2,
    )


def _commands(controller: Controller, measured: FloatArray) -> FloatArray:
    state = controller.new_state()
    commands = np.zeros((len(measured), kernel.COMMAND_SIZE))
    for row, command in zip(measured, commands, strict=True):
        kernel.controller_step(*controller.arguments, state, np.ascontiguousarray(row), command)
    return commands


_UNITS = {
    "displacement": "m",
    "velocity": "m/s",
    "amplitude": "m",
    "acceleration": "m/s^2",
    "ground": "m/s^2",
    "force": "N",
    "unclipped": "N",
    "drive": DRIVE,
    "inverse": DRIVE,
}

_FLAGS = frozenset({"clipped", "switched", "fault"})


def _in_unit(unit: str, drive_unit: str) -> str:
    """Return a unit, which is that of the drive where a table says `drive`."""
    return drive_unit if unit == DRIVE else unit


def _is_read(controller: Controller, name: str) -> bool:
    """Return whether the controller uses a reading; `name` is that of its index, such as MEASURED_FORCE."""
    place = getattr(kernel, name)
    if place >= kernel.MEASURED_FLOORS:
        return controller.floors > 0
    if place == kernel.MEASURED_ACCELERATION:
        known = (network.features.channels for network in controller.networks.values())
        return controller.options.velocity == "kalman" or any("acceleration" in channels for channels in known)
    return bool(controller.numbers[controller.layout[kernel.AT_LIMITS] + place] > 0.0)


def _index(controller: Controller, upper: str, name: str, drive_unit: str) -> str:
    """Return the definition of an index into measured[] or command[], with its meaning."""
    meaning = {**_READINGS, **_COMMANDS}.get(name, "")
    if name in _READINGS and not _is_read(controller, name):
        meaning += "; not used by this controller, may be 0"
    comment = f" /* {meaning.replace(f'[{DRIVE}]', f'[{drive_unit}]')} */" if meaning else ""
    return f"#define {upper}_{name} {getattr(kernel, name)}{comment}"


def _parameter(controller: Controller, upper: str, name: str, drive_unit: str) -> str:
    """Return the definition of the index of a parameter, with its meaning."""
    place, unit, meaning = PARAMETERS[name]
    law = law_named(controller.law)
    if name in _GAINS and _GAINS[name] not in law.c_body + law.c_helpers:
        meaning += f"; no effect under law {law.name}"
    return f"#define {upper}_PARAMETER_{name.upper()} {place} /* {meaning} [{_in_unit(unit, drive_unit)}] */"


def _header(controller: Controller, prefix: str, drive_unit: str) -> str:
    upper = prefix.upper()
    lines = [
        f"/* Controller of law {controller.law}: velocity, law, clipping, inverse, switch, low-pass, limits. */",
        f"#ifndef {upper}_CONTROLLER_H",
        f"#define {upper}_CONTROLLER_H",
        "",
        c_text.precision_header(prefix),
        "/* Indices into measured[] and command[]. */",
        *(_index(controller, upper, name, drive_unit) for name in _MACROS),
        f"#define {upper}_MEASURED_SIZE {controller.measured_size}",
        f"#define {upper}_STATE_SIZE {controller.state_size}",
        f"#define {upper}_SAMPLE_TIME_S {controller.sample_time_s!r}",
        "",
        "/* Indices into the array of parameters, which may be changed between two calls. */",
        *(_parameter(controller, upper, name, drive_unit) for name in PARAMETERS),
        f"{prefix}_real *{prefix}_controller_parameters(void);",
        "",
        "/* Set the memory to zero before the first call and whenever the loop was open. */",
        f"void {prefix}_controller_reset({prefix}_real state[{upper}_STATE_SIZE]);",
        "",
        "/* Call once a sample; hold command[COMMAND_DRIVE] until the next call. */",
        f"void {prefix}_controller_step({prefix}_real state[{upper}_STATE_SIZE],",
        f"                              const {prefix}_real measured[{upper}_MEASURED_SIZE],",
        f"                              {prefix}_real command[{upper}_COMMAND_SIZE]);",
        "",
        "#endif",
        "",
    ]
    return "\n".join(lines)


def _source(controller: Controller, law: Law, prefix: str) -> str:
    upper = prefix.upper()
    numbers = ",\n".join(
        "    " + ", ".join(_literal(value) for value in controller.numbers[start : start + 4])
        for start in range(0, len(controller.numbers), 4)
    )
    layout = ", ".join(str(int(value)) for value in controller.layout)
    macros = "\n".join(f"#define {name} {getattr(kernel, name)}" for name in (*_INNER_MACROS, *_MACROS))
    macros += f"\n#define OBSERVER_SIZE {max(1, 2 * int(controller.layout[kernel.FLOORS]))}"
    text = _TEMPLATE.read_text(encoding="utf-8")
    for key, value in {
        "@PREFIX@": prefix,
        "@UPPER@": upper,
        "@MACROS@": macros,
        "@PRECISION@": c_text.precision_macros(prefix),
        "@NUMBERS@": numbers,
        "@LAYOUT@": layout,
        "@LAW@": controller.law,
        "@LAW_HELPERS@": f"{law.c_helpers}\n" if law.c_helpers else "",
        "@LAW_BODY@": law.c_body,
    }.items():
        text = text.replace(key, value)
    return text


def _literal(value: float) -> str:
    """Return a C literal that reads back to the same double."""
    return float(value).hex()


def _description(controller: Controller, prefix: str, drive_unit: str, details: dict[str, Any]) -> dict[str, Any]:
    return {
        "law": controller.law,
        "prefix": prefix,
        "gains": dict(controller.gains),
        "options": asdict(controller.options),
        "sample_time_s": controller.sample_time_s,
        "parameters": {
            name: {
                "index": place,
                "value": float(controller.numbers[place]),
                "unit": _in_unit(unit, drive_unit),
                "meaning": meaning,
            }
            for name, (place, unit, meaning) in PARAMETERS.items()
        },
        "measured": _places("MEASURED_"),
        "measured_size": controller.measured_size,
        "command": _places("COMMAND_"),
        "state_size": controller.state_size,
        "numbers": [float(value) for value in controller.numbers],
        "layout": [int(value) for value in np.asarray(controller.layout)],
        **details,
    }


def _limits(controller: Controller) -> str:
    """Return the largest plausible readings in words."""
    at = int(controller.layout[kernel.AT_LIMITS])
    named = {
        "displacement": (kernel.MEASURED_DISPLACEMENT, "m"),
        "acceleration": (kernel.MEASURED_ACCELERATION, "m/s2"),
        "velocity": (kernel.MEASURED_VELOCITY, "m/s"),
        "force": (kernel.MEASURED_FORCE, "N"),
    }
    limits = {name: (float(controller.numbers[at + place]), unit) for name, (place, unit) in named.items()}
    return ", ".join(f"{name} {limit:.3g} {unit}" for name, (limit, unit) in limits.items() if limit > 0.0)


def _places(prefix: str) -> dict[str, int]:
    names = (name for name in _MACROS if name.startswith(prefix) and not name.endswith("_SIZE"))
    return {name.removeprefix(prefix).lower(): getattr(kernel, name) for name in names}


def _readme(controller: Controller, prefix: str, drive_unit: str) -> str:
    upper = prefix.upper()
    readings = "\n".join(
        f"- `{upper}_{name}`: {meaning.replace('each floor', f'each of the {controller.floors} floors')}"
        for name, meaning in _READINGS.items()
        if _is_read(controller, name)
    )
    unit = "" if drive_unit == DRIVE else f" {drive_unit}"
    hold = int(controller.layout[kernel.HOLD])
    return f"""# Controller of law {controller.law}

C99 without allocation and files; the only library is `math.h`. Build with `cc -std=c99 -c controller.c` and link
`-lm`. Define `{upper}_SINGLE` for single precision (`float`), else the numbers are `double`. A compiler that contracts
`a*b+c` (some do by default) changes the last digits, which `-ffp-contract=off` avoids.

`vectors.csv` holds readings of the sensors and the commands that mrpipe computes from them. `self_test.c` compares the
C code with them: `cc -std=c99 controller.c self_test.c -lm` builds a program that returns 0 where they agree.

Call `{prefix}_controller_reset` once, then `{prefix}_controller_step` every {controller.sample_time_s:g} s with

{readings}

in `measured`, whose other entries may be 0. Hold the drive `command[{upper}_COMMAND_DRIVE]`{unit and " in"}{unit} until
the next call. `controller.h` lists the other entries of `command`.

## Faulty readings

A reading is refused if it is NaN or infinite, or larger than the largest plausible one ({_limits(controller)}).

- For up to {hold} samples in a row ({1e3 * hold * controller.sample_time_s:.0f} ms) the last good reading replaces it;
  `{upper}_COMMAND_FAULT` is 1.
- After that, and before the first good sample, the drive is {controller.options.safe_drive:g}{unit};
  `{upper}_COMMAND_FAULT` is 2.
- At the next sample with good readings the controller starts anew, and `{upper}_COMMAND_FAULT` is 0.

Whatever the readings are, the drive is finite and lies between 0 and the drive limit, and the memory stays finite. This
holds for code compiled without `-ffast-math`, which would drop the test for NaN.

## Parameters

`{prefix}_controller_parameters()[{upper}_PARAMETER_C_N_S_M]` and the other names of `controller.h` give access to the
gains, limits and filters. They may be changed between two calls of the step.

`controller.json` holds gains, options, named parameters and all numbers.
"""
