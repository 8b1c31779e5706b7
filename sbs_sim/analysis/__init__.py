"""Trim of the model: the Python API and the bodies of the services."""
