"""The laws that the base-isolated building and the tower are run under."""

from __future__ import annotations

from collections.abc import Sequence

from mrpipe.errors import UserError

LAWS = ("vd", "vdns", "fdns", "lqg", "lqg-clipped", "passive-off", "passive-on")
"""VD, VDNS, FDNS with MR dampers; LQG with ideal actuators, and clipped on the MR dampers; constant voltages."""


def unknown_law(law: str, structure: str) -> UserError:
    """Return the error for a law that is not in :data:`LAWS`; `structure` as in "the tower"."""
    return UserError("--law", law, f"is not a law of {structure}", f"known: {', '.join(LAWS)}")


def require_known(laws: Sequence[str], structure: str) -> None:
    """Raise UserError if one of the laws is not in :data:`LAWS`."""
    for law in laws:
        if law not in LAWS:
            raise unknown_law(law, structure)
