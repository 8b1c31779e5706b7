"""Trims, linear models, sweeps and batches of flights."""
