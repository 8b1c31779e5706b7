"""Command lines and progress bars of the executables."""
