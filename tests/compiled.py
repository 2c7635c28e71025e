"""Compilation of all functions before the suite starts: otherwise each of its processes compiles them for itself.

python -m tests.compiled
"""

from __future__ import annotations

from mrpipe.pipeline.compile_ahead import main, modules_of
from mrpipe.stages.registry import all_stages

if __name__ == "__main__":
    main(modules_of(stage.run.__module__ for stage in all_stages().values()))
