"""Compiled parts of the stick-slip model; loaded by the modules that run it."""
