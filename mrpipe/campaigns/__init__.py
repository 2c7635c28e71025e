"""Measured campaigns: reading, checking, describing and writing them."""

from mrpipe.campaigns.checks import require_varying, require_varying_drive
from mrpipe.campaigns.loading import campaign_files, load_campaign
from mrpipe.campaigns.model import Campaign, Recording
from mrpipe.campaigns.writing import CAMPAIGN_FILE, TestFile, write_campaign

__all__ = [
    "CAMPAIGN_FILE",
    "Campaign",
    "Recording",
    "TestFile",
    "campaign_files",
    "load_campaign",
    "require_varying",
    "require_varying_drive",
    "write_campaign",
]
