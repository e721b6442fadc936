"""Compiled structural facts of chains, block by block, for the catalogue."""
