"""A configuration of the main job on a rig of six short tests, which takes seconds."""

from typing import Any

MAIN_JOB: dict[str, Any] = {
    "stages": ["record-bench", "prepare", "assemble", "sweep", "train-forward", "train-inverse", "identify-damper",
               "report"],
    "campaigns": {"bench": "laboratory", "frame": None, "closed_loop": None},
    "laboratory": {
        "hidden_effects": [],
        "bench": {
            "plan": "custom",
            "tests": [
                {"name": f"{role[0]}-{current}-{level}", "role": role, "current": current, "current_a": level,
                 "frequency_hz": 1.5, "duration_s": 4.0}
                for role in ("training", "validation")
                for current, level in (("constant", 0.0), ("constant", 2.0), ("half-sine", 4.0))
            ],
        },
    },
    "sweep": {"states": [["velocity"]], "past_values": [0], "layers": [2], "neurons": [3], "biases": [False],
              "starts": 1, "refined": 1, "screen_iterations": 3, "refine_iterations": 3},
    "train_forward": {"starts": 1, "refined_starts": 1, "subsample_iterations": 3, "iterations": 3},
    "train_inverse": {"starts": 1, "refined_starts": 1, "subsample_iterations": 3, "iterations": 3},
    "identify_damper": {"compare": ["bouc-wen"], "starts": 1},
}  # fmt: skip
"""The rig has no hidden effect, so that a tracing ends early."""
