"""The motor-driven platform: effective inertia, models with and without inertia, the resistance claim."""
