"""Compiled kernels of the stick-slip model: drives and laws, closed-form pieces, the automaton, time stepping."""
