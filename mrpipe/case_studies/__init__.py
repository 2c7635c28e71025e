"""Published structures with dampers, studied with the program's own models: one folder per structure."""
