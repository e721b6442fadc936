"""The tribometer: an upper platform on a spring, dragged by friction on a driven lower platform."""
