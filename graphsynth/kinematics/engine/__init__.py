"""The general engine: any planar mechanism as drivers and Assur groups, solved in order.

``program`` turns a mechanism into flat tables, ``kernels`` runs them, ``follow`` controls the steps, ``events`` finds
what happens on the way.  Use :func:`graphsynth.kinematics.simulate`.
"""
