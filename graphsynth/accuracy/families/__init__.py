"""What of a scene is measured: one module for each family of scenes, imported when such a scene is measured."""
