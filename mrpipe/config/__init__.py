"""Settings of the user: model of the configuration, its sections, and its loader."""
