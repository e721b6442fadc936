"""Compiled kernels of the planar engine.

The state of a link at one sample is a row of eleven numbers: x, y, cos theta, sin theta, theta (unwrapped; right only
where gears need it), the velocity (x', y', theta') and the acceleration.  Over many samples the same numbers lie in
arrays with the sample as last axis.
"""
