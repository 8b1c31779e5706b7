"""Panel of the moving air: steady wind, turbulence, gusts, and own gusts from a file."""

from collections.abc import Callable, Mapping
from html import escape
from typing import Any

import numpy as np
from numpy.typing import NDArray
from viser import ViserServer

from sbs_sim.errors import SimulationError
from sbs_sim.flight.gust_file import MAX_SIZE, gust_table
from sbs_sim.flight.gust_standards import WIND_AT_20_FT, specified_turbulence
from sbs_sim.model.gust_table import TIME, GustTable
from sbs_sim.model.wind import CHOICES

Array = NDArray[np.float64]
Fields = dict[str, Any]

AXES = ("North", "East", "Down")
OWN_SIGMA = "σ as given"
SPECIFIED = {OWN_SIGMA: None} | {f"MIL-F-8785C, {name}": name for name in WIND_AT_20_FT}
NO_GUST, OVER_TIME = "none", "1-cosine over time"
SHAPES = {"1-cosine over distance": "one_minus_cosine", "ramp over distance": "ramp"}
SHOWN = ("turbulence_model", "turbulence_extent", "wind_profile")  # of what was set, by their words
UPLOAD = "Own gust from a file"
FOLDER = "Wind, velocity of the air"


class AirPanel:
    """Fields of what a simulator can be asked of the air.

    Parameters
    ----------
    server : ViserServer
    ask : callable
        Sends what is set.
    refuse : callable
        Says why a file is no gust.
    """

    def __init__(self, server: ViserServer, ask: Callable[[], None], refuse: Callable[[str], None]) -> None:
        self._gui, self._refuse, self._own = server.gui, refuse, ""
        self._table: GustTable | None = None
        with self._gui.add_folder(FOLDER, expand_by_default=False):
            self._wind = self._vector(100.0)
            self._profile = self._gui.add_dropdown("Profile", CHOICES["wind_profile"], hint="over the height")
            self._add_turbulence()
            self._add_gusts()
            self._gui.add_button("Set wind").on_click(lambda _: ask())
        self._known: dict[int, Any] = {}  # values that were asked for or shown last, by the identities of fields
        self._take_as_known()
        self._show_what_acts()

    def _vector(self, most: float) -> list[Any]:
        return [self._gui.add_number(f"{name} [m/s]", 0.0, min=-most, max=most, step=0.5) for name in AXES]

    def _add_turbulence(self) -> None:
        gui = self._gui
        self._turbulence = gui.add_number("Turbulence, σ [m/s]", 0.0, min=0.0, max=20.0, step=0.1)
        self._spectrum = gui.add_dropdown("Spectrum", CHOICES["turbulence_model"])
        hint = (
            "point: the same everywhere; rates: the air turns, too; field, elements: that of rotors, of blade elements"
        )
        self._extent = gui.add_dropdown("Extent", CHOICES["turbulence_extent"], hint=hint)
        self._specified = gui.add_dropdown("Intensity", tuple(SPECIFIED))
        self._specified.on_update(lambda _: self._show_what_acts())
        self._height = gui.add_number("At height [m]", 30.0, min=0.0, max=20_000.0, step=1.0, hint="of MIL-F-8785C")

    def _add_gusts(self) -> None:
        gui = self._gui
        with gui.add_folder("Gust", expand_by_default=False):
            self._shape = gui.add_dropdown("Shape", (NO_GUST, OVER_TIME, *SHAPES))
            self._shape.on_update(lambda _: self._show_what_acts())
            self._gust = [
                gui.add_number(f"Gust {name.lower()} [m/s]", 0.0, min=-100.0, max=100.0, step=0.5) for name in AXES
            ]
            hint = "s of a gust over time, m of one over distance; of a file and of a shape alike"
            self._begin = gui.add_number("Begins after [s or m]", 0.0, min=0.0, max=1e6, step=0.5, hint=hint)
            self._length = gui.add_number("Length [s or m]", 2.0, min=0.0, max=1e6, step=0.5)
            file = gui.add_upload_button(UPLOAD, mime_type=".csv,text/csv", hint="CSV, see set_wind: own_gust_csv")
            file.on_upload(lambda event: self.take_file(event.target.value.name, event.target.value.content))
            self._file = gui.add_html("", visible=False)
            self._remove = gui.add_button("Remove the file", visible=False)
            self._remove.on_click(lambda _: self._keep("", None))

    def take_file(self, name: str, content: bytes) -> None:
        """Take over a file of a user, or say why it is no gust."""
        try:
            if len(content) > MAX_SIZE:
                raise SimulationError(f"{len(content)} bytes: allowed are up to {MAX_SIZE}")
            text = content.decode("utf-8-sig")
            table = gust_table(text)
        except UnicodeDecodeError as error:
            self._refuse(f"the file is no text: {error}")
        except SimulationError as error:
            self._refuse(str(error))
        else:
            self._keep(text, table)

    def _keep(self, text: str, table: GustTable | None) -> None:
        self._own, self._table = text, table
        self._file.content = escape(f"own gust: {len(table.positions)} rows over {table.over}") if table else ""
        self._show_what_acts()

    def _show_what_acts(self) -> None:
        """Hide the fields that what is chosen makes idle."""
        specified, shaped = self._specified.value != OWN_SIGMA, self._shape.value != NO_GUST
        self._turbulence.visible, self._height.visible = not specified, specified
        for field in (*self._gust, self._length):
            field.visible = shaped
        self._file.visible = self._remove.visible = self._table is not None
        self._begin.visible = shaped or self._table is not None

    def _take_as_known(self) -> None:
        following = (*self._wind, self._turbulence, self._specified, self._spectrum, self._extent, self._profile)
        self._known = {id(field): field.value for field in following}

    def _follow(self, field: Any, value: Any) -> None:
        """Show a value, unless somebody has changed the field since it was known and has yet to ask for that."""
        if field.value == self._known[id(field)]:
            field.value = self._known[id(field)] = value

    def fields(self) -> Fields:
        """Fields of a request, which is made now; vectors as three numbers.

        Raises
        ------
        SimulationError
            The specification has no turbulence at that height.
        """
        self._take_as_known()
        sigma = float(self._turbulence.value)
        found: Fields = {
            "velocity": tuple(float(number.value) for number in self._wind),
            "wind_profile": self._profile.value,
            "turbulence_intensity": (sigma,) * 3,
            "turbulence_model": self._spectrum.value,
            "turbulence_extent": self._extent.value,
            "own_gust_csv": self._own,
        }
        severity = SPECIFIED.get(self._specified.value)
        if severity is not None:
            found |= specified_turbulence(float(self._height.value), severity, model=self._spectrum.value)
        if self._table is not None:
            found["gust_delay" if self._table.over == TIME else "gust_distance"] = float(self._begin.value)
        if self._shape.value != NO_GUST:
            found["gust"] = tuple(float(number.value) for number in self._gust)
            over_time = self._shape.value == OVER_TIME
            found["gust_delay" if over_time else "gust_distance"] = float(self._begin.value)
            found["gust_duration" if over_time else "gust_length"] = float(self._length.value)
            found["gust_shape"] = SHAPES.get(self._shape.value, "one_minus_cosine")
        return found

    def set_turbulence(self, sigma: float) -> None:
        """Choose a standard deviation in place of that of a specification [m/s]."""
        self._turbulence.value, self._specified.value = sigma, OWN_SIGMA

    def show(self, velocity: Array, turbulence: float, words: Mapping[str, str]) -> None:
        """The wind that was set: steady, NED [m/s], shape (3,), the largest part of its turbulence, and its kinds.

        What somebody is setting stays as it is.
        """
        for number, value in zip(self._wind, velocity, strict=True):
            self._follow(number, round(float(value), 3))
        if self._specified.value == self._known[id(self._specified)] == OWN_SIGMA:
            self._follow(self._turbulence, round(turbulence, 3))
        for list_, name in zip((self._spectrum, self._extent, self._profile), SHOWN, strict=True):
            if words.get(name) in CHOICES[name]:
                self._follow(list_, words[name])
