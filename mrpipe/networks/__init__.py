"""Forward and inverse networks of a damper: training sets, training, architecture sweep (thesis 2.3)."""

from mrpipe.networks.network import FeatureSpec, Network, lagged, read_network, write_network

__all__ = ["FeatureSpec", "Network", "lagged", "read_network", "write_network"]
