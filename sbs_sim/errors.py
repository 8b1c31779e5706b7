"""The exceptions of this package: one family, so that a caller can catch all of them."""


class SbsError(Exception):
    """Anything that this package reports to its user in one line."""


class AircraftError(SbsError):
    """An aircraft description that cannot be used."""


class AirfoilError(AircraftError):
    """An airfoil table that cannot be used."""


class TrimError(SbsError):
    """No equilibrium was found for a flight condition."""


class LinearizationError(SbsError):
    """A linear model that cannot be made."""


class SimulationError(SbsError):
    """A simulation that cannot start or cannot go on."""
