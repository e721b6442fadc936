"""The code of the stress cases, one module for each thing that is stressed; imported by the catalogue."""
