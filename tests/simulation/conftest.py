"""A rig for the tests: the thesis' frame, damper set C, the inverse of its post-yield force."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from mrpipe.artifacts import load_parameter_set
from mrpipe.control import Controller, ControllerOptions, Gains, InverseTable, build_controller, inverse_table
from mrpipe.control.lqg import Weights, lqg_observer
from mrpipe.control.neural import ReferenceOptions, train_reference
from mrpipe.dampers.model import DamperModel, damper_from_parameter_set
from mrpipe.networks.network import Network
from mrpipe.simulation import Excitation, LoopOptions, Response, harmonic, simulate_law
from mrpipe.simulation.adjustment import adjusted_amplitude
from mrpipe.simulation.indices import indices
from mrpipe.structures import Frame, frame_from_parameter_set, natural_modes
from mrpipe.thesis.gains import THESIS_GAINS


@dataclass(frozen=True)
class Rig:
    frame: Frame
    damper: DamperModel
    position: np.ndarray
    inverse: InverseTable
    reference: Network
    ideal_amplitude: float
    adjusted_amplitude: float

    def controller(
        self, law: str, gains: Gains | None = None, inverse: Network | None = None, **options: Any
    ) -> Controller:
        thesis: dict[str, Any] = {"residual_force_n": 18.0, "friction_rounding_m_s": 0.0125}
        chosen = ControllerOptions(**{**thesis, **options})
        observer = None
        if law == "lqg":
            observer = lqg_observer(self.frame, self.position, Weights(), 1.0 / chosen.rate_hz)
        if gains is None:
            gains = THESIS_GAINS.get(law, Gains())
        reference = self.reference if law == "nnc" else None
        used = inverse or self.inverse
        return build_controller(law, gains, chosen, inverse=used, reference=reference, observer=observer)

    def excitation(self, amplitude: float, cycles: int = 40, decay_s: float = 6.0) -> Excitation:
        return harmonic(amplitude, 8.0, cycles=cycles, settling_cycles=cycles // 2, decay_s=decay_s)

    def run(self, law: str, options: LoopOptions, factor: float = 1.0, **controller: Any) -> tuple[Response, dict]:
        amplitude = self.adjusted_amplitude if options.tracking == "damper" else self.ideal_amplitude
        if options.tracking == "ideal":
            perfect: dict[str, Any] = {"rate_hz": 500.0, "velocity": "measured", "friction_rounding_m_s": 0.019}
            controller = perfect | controller
        excitation = self.excitation(factor * amplitude)
        response = simulate_law(
            self.frame,
            self.damper.chain(),
            self.controller(law, **controller),
            excitation,
            options,
            rng=np.random.default_rng(5),
        )
        return response, indices(response, excitation, residual_force_n=22.0, drive_limit=4.0)


@pytest.fixture(scope="session")
def rig() -> Rig:
    frame = frame_from_parameter_set("thesis")
    damper = damper_from_parameter_set(load_parameter_set("dampers", "set-c"))
    position = np.eye(5)[0]
    amplitudes = tuple(0.0093 * np.geomspace(0.2, 2.0, 7))
    frequencies = tuple(8.0 / (2.0 * np.pi) * np.geomspace(0.625, 1.6, 7))
    others = tuple(natural_modes(frame).angular_frequencies[1:])
    options = ReferenceOptions(
        3000.0, amplitudes, frequencies, starts=2, rounding_m_s=0.0125, disturbances_rad_s=others
    )
    reference = train_reference(options, np.random.default_rng(1)).network
    inverse = inverse_table(damper)
    viscous = build_controller("vd", Gains(650.0), ControllerOptions(residual_force_n=18.0), inverse=inverse)
    adjusted, _, _ = adjusted_amplitude(
        frame,
        damper.chain(),
        viscous,
        lambda amplitude: harmonic(amplitude, 8.0, cycles=30, settling_cycles=15),
        LoopOptions(),
        position=position,
        rms_top_m=0.0243,
    )
    ideal = 0.788  # as the errata has it
    return Rig(frame, damper, position, inverse, reference, ideal, adjusted)
