"""What every other subpackage needs: errors, checks of arguments, compiled kernels, workers, journals, text files."""
