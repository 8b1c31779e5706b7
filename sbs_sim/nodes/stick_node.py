"""What `teleop` and `joystick` have in common: sticks and augmentation around controls taken over in flight."""

import time
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sbs_msgs.msg import FlightEvent
from sbs_sim.aircraft import Aircraft
from sbs_sim.analysis.linearize import linearize
from sbs_sim.model import state as S
from sbs_sim.model.frames import quaternion_to_euler
from sbs_sim.nodes.parameters import Parameter, declare
from sbs_sim.nodes.pilot_node import PilotNode
from sbs_sim.pilot.augmentation import StickPilot, augmentation

Array = NDArray[np.float64]

STICK_PARAMETERS = {
    "aircraft": Parameter("sbs", "Aircraft: a name in config/aircraft, or the path of a file"),
    "augmentation": Parameter(True, "Start with stability augmentation"),
}
SETTLING_TIME = 0.3  # s of wall time in which the events of the flight so far arrive


class StickNode(PilotNode):
    """A pilot with sticks, who takes over the present controls.

    Parameters
    ----------
    name : str
    parameters : dict of str to Parameter
    """

    def __init__(self, name: str, parameters: dict[str, Parameter]) -> None:
        super().__init__(name)
        self.settings: dict[str, Any] = declare(self, parameters)
        self._aircraft = Aircraft.load(self.settings["aircraft"])
        self._found = augmentation(linearize(self._aircraft))
        self._current_controls: Array | None = None  # of the four axes, at the latest event
        self._first_event = 0.0
        self._other_rotors = 0  # of the aircraft that flies, if it is not the one that this node knows
        self._first: tuple[Array, float, float] | None = None  # trim at the take-over

    def make_pilot(self, deflections: ArrayLike) -> None:
        """Make the pilot with the departures of the controls at full stick [rad], shape (4,)."""
        self.pilot = StickPilot(self._found, deflections)
        self.pilot.augmented = self.settings["augmentation"]

    def sticks(self) -> Array:
        """Sticks now, shape (4,), -1 to 1."""
        raise NotImplementedError

    def controls_for(self, now: float, body: Array) -> Array | None:
        """Sticks and augmentation; nothing until the present controls are known."""
        if self._first is None:
            if self._current_controls is None or time.monotonic() - self._first_event < SETTLING_TIME:
                return None
            self._take_over(self._current_controls, body)
        if now < self.time:
            self._first, self._first_event = None, time.monotonic()  # another flight, whose start has the controls
            return None
        self.pilot.sticks = self.sticks()
        return self.pilot.controls(now, body)

    def _take_over(self, controls: Array, body: Array) -> None:
        _, pitch, roll = quaternion_to_euler(body[S.ATTITUDE : S.VELOCITY])
        self._first = (controls, pitch, roll)
        self.pilot.take_over(*self._first)
        self.get_logger().info(f"flying, augmentation {self.switch}")

    def on_event(self, event: FlightEvent, is_new: bool) -> None:
        """Update the present controls; after a reset they belong to another flight."""
        angles = np.array(event.swashplate)
        rows = len(angles) // S.ROW
        self._other_rotors = rows if rows != len(self._aircraft.rows) else 0
        if len(angles) != S.ROW * len(self._aircraft.rows):
            return
        if self._current_controls is None:
            self._first_event = time.monotonic()
        if self._first is None or event.kind in (FlightEvent.START, FlightEvent.RESET):
            self._current_controls = self._aircraft.unmix(angles)[self._aircraft.axis_controls]
        if (
            self._first is not None
            and is_new
            and event.kind == FlightEvent.RESET
            and self._current_controls is not None
        ):
            self.released()
            self._take_over(self._current_controls, np.array(event.state))

    def waiting_for(self) -> str:
        """What is missing before the controls can be taken over."""
        if self._first is None and self._other_rotors:
            own = f"{self._aircraft.name} has {len(self._aircraft.rows)}"
            return f"another flight: the aircraft of this one has {self._other_rotors} rotors, {own}; see aircraft:="
        what = super().waiting_for()
        if not what and self._first is None and self._current_controls is None:
            return f"{self.topic('events')}, which has the present controls"
        return what

    def released(self) -> None:
        """Let go of the sticks, because the flight is another."""

    @property
    def switch(self) -> str:
        """On or off."""
        return "on" if self.pilot.augmented else "off"

    def switch_augmentation(self) -> None:
        """Switch the augmentation."""
        self.pilot.augmented = not self.pilot.augmented
        self.get_logger().info(f"augmentation {self.switch}")

    def take_trim(self) -> None:
        """The controls and the attitude of now are the trim from now on."""
        if self.body is not None and self._first is not None:
            _, pitch, roll = quaternion_to_euler(self.body[S.ATTITUDE : S.VELOCITY])
            self.pilot.take_over(self.pilot.controls(self.time, self.body), pitch, roll)
            self.get_logger().info("trim taken")

    def first_trim(self) -> None:
        """Back to the trim at the take-over."""
        if self._first is not None:
            self.pilot.take_over(*self._first)
            self.get_logger().info("back to the first trim")

    def values(self) -> dict[str, object]:
        """Switch of the augmentation."""
        return {"augmentation": self.switch}
