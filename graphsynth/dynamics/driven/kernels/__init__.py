"""Compiled drives: motor, train and mechanism of one freedom as one stiff system, with its own integrator."""
