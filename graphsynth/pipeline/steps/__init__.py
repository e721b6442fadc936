"""Stage functions: thin adapters between a scene and the rooms that do the work, imported by name on demand."""
