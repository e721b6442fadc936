"""Dimensioned mechanisms: a graph, the geometry of its joints on the links, drivers and their motion laws.

Import from the modules; this file loads none of them.
"""
