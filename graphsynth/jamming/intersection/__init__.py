"""Circle and ellipse with tolerances: the interval problem of the source, solved exactly and by Krawczyk's method."""
