"""From measured magnetorheological dampers to a closed-loop run, and back to the effect that a model lacks."""

from mrpipe.numba_cache import use_keyed_cache

__version__ = "0.1.0"

use_keyed_cache()
