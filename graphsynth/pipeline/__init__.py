"""Scenes: a scene file, its stages, the runner and the report.

The only room that knows all the others, and it knows them by name: a stage is a string, imported when a scene
needs it (see :mod:`graphsynth.pipeline.stages`).
"""
