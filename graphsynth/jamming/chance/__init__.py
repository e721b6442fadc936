"""How likely a mechanism of a tolerance box binds, with proof, and what its tolerances should cost.

A margin (`margin`) and distributions (`distributions`) make a probability (`probability`): boxes of the tolerances are
cut (`paving`) until the margin is nearly linear in each, and the probability of a half space is enclosed (`halfspace`).
"""
