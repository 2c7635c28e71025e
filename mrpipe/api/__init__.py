"""The Python interface for notebooks and scripts.

A measured damper, traced and simulated in a structure::

    import mrpipe

    tests = mrpipe.prepare(mrpipe.load_campaign("data/my-rig"))
    damper = mrpipe.fit_damper(tests)
    traced = mrpipe.trace(tests)
    frame = mrpipe.identify_frame(mrpipe.load_campaign("data/my-frame"))
    loop = mrpipe.simulate(frame, traced.damper, law="fdns", base_amplitude_m_s2=0.8)
    print(traced, loop)

Each function calls what the stage of the same name calls, with the same settings and defaults: a keyword argument is a
setting of the stage's section in docs/configuration.md. Results print as text; `plot` returns a matplotlib figure, and
`to_frame` a pandas table.
"""

from mrpipe.api.bench import DamperFit, PreparedTests, Traced, fit_damper, load_campaign, prepare, trace
from mrpipe.api.exports import export
from mrpipe.api.loop import Designed, Simulated, design, simulate
from mrpipe.api.rows import network_rows
from mrpipe.api.runs import Run, open_run
from mrpipe.api.structure import IdentifiedFrame, identify_frame
from mrpipe.networks.estimator import NetworkRegressor

__all__ = [
    "DamperFit",
    "Designed",
    "IdentifiedFrame",
    "NetworkRegressor",
    "PreparedTests",
    "Run",
    "Simulated",
    "Traced",
    "design",
    "export",
    "fit_damper",
    "identify_frame",
    "load_campaign",
    "network_rows",
    "open_run",
    "prepare",
    "simulate",
    "trace",
]
