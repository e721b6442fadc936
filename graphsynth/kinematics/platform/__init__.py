"""Analysis and design of the parallel platform: workspace, singularities, maps, statics, inverse design, rank check.

This file loads none of its modules: import the one you need, for instance `graphsynth.kinematics.platform.workspace`.
"""
