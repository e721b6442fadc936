"""The built-in family of scenes: any planar mechanism."""
