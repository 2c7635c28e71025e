"""Every printed figure of the thesis beside what this program computes: a module a chapter."""

from mrpipe.thesis.claim import Claim, Number, cannot, compare
from mrpipe.thesis.collect import ClaimOptions, collect_claims

__all__ = ["Claim", "ClaimOptions", "Number", "cannot", "collect_claims", "compare"]
