"""Equations of motion in three forms: one coordinate, partitioned coordinates, augmented with multipliers."""
