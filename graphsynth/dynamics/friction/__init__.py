"""Dry friction in the joints of a planar mechanism: laws, the friction problem at one state, sticking and sliding."""
