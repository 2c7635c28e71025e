"""Measured campaigns: reading, checking, describing and writing them."""

from mrpipe.campaigns.model import Campaign, Recording
from mrpipe.campaigns.writing import CAMPAIGN_FILE, TestFile, write_campaign

__all__ = ["CAMPAIGN_FILE", "Campaign", "Recording", "TestFile", "write_campaign"]
