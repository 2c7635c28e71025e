"""Proposes a campaign for a folder of measured files: channels, units, roles, and what remains unsure."""

from mrpipe.campaigns.proposal.propose import Proposal, propose_campaigns

__all__ = ["Proposal", "propose_campaigns"]
