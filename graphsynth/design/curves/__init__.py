"""An index of the curves that mechanisms draw: made, stored, searched."""
