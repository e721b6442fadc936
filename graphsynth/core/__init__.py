"""What every room of the package builds on."""
