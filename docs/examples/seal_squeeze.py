"""A lip seal that the oil pressure squeezes onto the rod."""

import numpy as np
from numba import njit

from mrpipe.dampers.plant import FORCE, HYSTERETIC_FORCE, STEP_SIGNATURE, VELOCITY, Phase, Step
from mrpipe.effects.contract import Effect, EffectForm, Separation, amplitude, shape


@njit(STEP_SIGNATURE, cache=True)
def squeeze_step(wire, state, parameters, dt):
    """Parameters: force per newton of yield force, speed that rounds the change of direction [m/s]."""
    direction = np.tanh(wire[VELOCITY] / parameters[1])
    wire[FORCE] += parameters[0] * abs(wire[HYSTERETIC_FORCE]) * direction


def _steps(values):
    numbers = np.array([values["friction"], values["rounding_speed"]])
    return [Step("seal-squeeze", Phase.FORCE_EFFECT, squeeze_step, numbers)]


EFFECT = Effect(
    name="seal-squeeze",
    summary="friction of a seal that grows with the pressure in the damper",
    physics="The pressure difference presses the lip of the seal onto the rod: friction grows with the yield force.",
    remedy="Fit a seal with a back-up ring, or measure the force at rest at several currents.",
    source="own observation on the bench; see Nikas (2010) on reciprocating seals",
    acts_on="force",
    forms=(
        EffectForm(
            "proportional",
            "F = mu |F_y| tanh(v/v0)",
            (
                shape(
                    "rounding_speed", "m/s", "speed that rounds the change of direction", "speed", 0.005, 0.5, (0.05,)
                ),
                amplitude("friction", "1", "friction force per newton of yield force", "one", 0.0, 1.0),
            ),
            _steps,
            amplitude_steps={"friction": 0},
            dissipative=True,
        ),
    ),
    needs=("varying-speed",),
    separated_by={
        "stribeck": Separation(
            "constant drive at several speeds: the seal's share follows the yield force", ("constants",)
        )
    },
)
