"""The exceptions of this package: one family, so that a caller can catch all of them."""


class SbsError(Exception):
    """Anything that this package reports to its user in one line."""


class AircraftError(SbsError):
    """An aircraft description that cannot be used."""


class AirfoilError(AircraftError):
    """An airfoil table that cannot be used."""


class TrimError(SbsError):
    """No equilibrium was found for a flight condition.

    Attributes
    ----------
    residual : float or None
        Largest scaled residual where the search ended; None if there was no search.
    worst_equation : str or None
        The equation that it is in, as "d(state)/dt".
    """

    def __init__(self, message: str, *, residual: float | None = None, worst_equation: str | None = None) -> None:
        super().__init__(message)
        self.residual, self.worst_equation = residual, worst_equation


class LinearizationError(SbsError):
    """A linear model that cannot be made."""


class IdentificationError(SbsError):
    """Frequency responses that cannot be identified, or an excitation for them that cannot be flown."""


class RecordingError(SbsError):
    """A log that cannot be written or read."""


class SimulationError(SbsError):
    """A simulation that cannot start or cannot go on."""


class SweepError(SbsError):
    """A sweep that cannot start."""


class BatchError(SbsError):
    """A batch of flights that cannot start."""


class ClusterError(SbsError):
    """A cluster that cannot be reached, or whose workers are not like this process."""


class ValidationError(SbsError):
    """A comparison with published results that cannot be made."""


class ExportError(SbsError):
    """A file that cannot be written."""


class PilotError(SbsError):
    """A controller that cannot be designed, or a target or stick that it cannot take."""


class ArduPilotError(SbsError):
    """A packet of ArduPilot that is none, or a servo file that does not fit an aircraft."""
