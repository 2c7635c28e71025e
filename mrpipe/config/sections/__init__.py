"""Settings of each stage, one file a section."""
