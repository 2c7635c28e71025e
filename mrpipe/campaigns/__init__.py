"""Measured campaigns: reading, checking, describing and writing them."""

from mrpipe.campaigns.checks import require_varying
from mrpipe.campaigns.describe import describe
from mrpipe.campaigns.header import CampaignHeader, read_header
from mrpipe.campaigns.loading import campaign_files, load_campaign
from mrpipe.campaigns.model import CAMPAIGN_FILE, Campaign, Recording
from mrpipe.campaigns.writing import TestFile, write_campaign

__all__ = [
    "CAMPAIGN_FILE",
    "Campaign",
    "CampaignHeader",
    "Recording",
    "TestFile",
    "campaign_files",
    "describe",
    "load_campaign",
    "read_header",
    "require_varying",
    "write_campaign",
]
