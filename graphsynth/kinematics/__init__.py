"""Closed-form kinematics: the lambda linkage, the planar parallel platform, the single-motor platform.

Import from the modules (or from ``graphsynth``): this file loads none of them, so that each costs only itself.
"""
