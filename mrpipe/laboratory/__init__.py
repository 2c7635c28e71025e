"""The virtual rig that stands in for hardware."""
