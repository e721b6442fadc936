"""Named systems, each at home in one folder; entry points register them."""
