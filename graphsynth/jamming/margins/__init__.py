"""The margin of all joints of a mechanism together, for probabilities: proved linear bounds over boxes of tolerances.

Quantities (`quantities`) set limits, misalignments and lengths; stations (`stations`) are pieces of the input with
proved positions; each pair of a box and a station is bounded by a linear function from either side (`lines`).
"""
