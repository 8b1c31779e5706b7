"""The linear model of a steady flight: matrices, modes, derivatives (theory.md section 9)."""

from __future__ import annotations  # `help` then shows types by their names

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sbs_sim import checks
from sbs_sim.aircraft import Aircraft
from sbs_sim.analysis import export
from sbs_sim.analysis.bandwidth import Bandwidth, bandwidth
from sbs_sim.analysis.control_effects import ControlEffect, control_effects
from sbs_sim.analysis.frequency_response import Actuator, FrequencyResponse, frequency_response
from sbs_sim.analysis.modes import Mode, modes
from sbs_sim.content import ByContent
from sbs_sim.errors import ExportError, LinearizationError
from sbs_sim.flight.trim_point import StandPoint, TrimPoint
from sbs_sim.model import state as S
from sbs_sim.model.solve import product, solve
from sbs_sim.output.files import check_target, write
from sbs_sim.output.notebook import model_html

Array = NDArray[np.float64]

FORCES = {"u": "X", "v": "Y", "w": "Z"}  # Padfield's names by the equation
MOMENTS = {"p": "L'", "q": "M", "r": "N'"}
MOTIONS = ("u", "w", "q", "v", "p", "r")


@dataclass(frozen=True, eq=False)
class LinearModel(ByContent):
    """x' = A x + B u, y = C x + D u for small departures from a trimmed flight.

    Attributes
    ----------
    a : ndarray, shape (n, n)
    b : ndarray, shape (n, m)
    c : ndarray, shape (o, n)
    d : ndarray, shape (o, m)
    state_names, state_units : tuple of str, length n
        The paper's order, eq. [18]; states that the fidelity leaves out are not there.
    control_names, control_units : tuple of str, length m
        Pilot controls, eq. [19].
    output_names, output_units : tuple of str, length o
        Body states, climb rate, specific force of the c.g. (body axes), loads and power of every rotor (hub forces and
        moments in body axes about the hub).
    steps : ndarray, shape (n + m,)
        Half the distance of the differences, in the units of states and controls.
    trim : TrimPoint
    method : str
        "averaged" or "paper".
    azimuth_spread : float
        Largest departure of A at one azimuth from their mean, Frobenius norms of the matrices in steps, relative: near
        0 a time-invariant model is exact. Not a number where there is one azimuth only.
    spread : ndarray, shape (n, n + m)
        Half the range over the azimuth of each element of A and B.
    parameter_hash : str
        Of the aircraft, see `Aircraft.parameter_hash`.
    blocks : mapping of str to ndarray
        Method `paper` only: its matrices by name, see `sbs_sim.analysis.paper_method`.
    kinematics : ndarray, shape (8, 8)
        What A_B-B has without any load: turning axes, gravity, attitude, gyroscopic moments; see `kinematics`.
    """

    a: Array
    b: Array
    c: Array
    d: Array
    state_names: tuple[str, ...]
    state_units: tuple[str, ...]
    control_names: tuple[str, ...]
    control_units: tuple[str, ...]
    control_axes: tuple[str, ...]
    output_names: tuple[str, ...]
    output_units: tuple[str, ...]
    steps: Array
    trim: TrimPoint
    method: str
    azimuth_spread: float
    spread: Array
    parameter_hash: str
    kinematics: Array
    blocks: Mapping[str, Array] = field(default_factory=dict)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Where the model does not hold in the flight that it is about, a line each; see `TrimPoint`."""
        return self.trim.warnings

    @cached_property
    def modes(self) -> tuple[Mode, ...]:
        """Modes by name, slowest first."""
        return modes(self.a, self.state_names)

    @property
    def growing_rotor_modes(self) -> tuple[Mode, ...]:
        """Modes of flap, lag and inflow that grow, slowest first: what no pilot can hold."""
        return tuple(mode for mode in self.modes if mode.family != "body" and mode.is_growing)

    @cached_property
    def poles(self) -> NDArray[np.complex128]:
        """All eigenvalues of A [rad/s], shape (n,), both of each pair, slowest first."""
        poles = np.linalg.eigvals(self.a).astype(complex)
        return poles[np.lexsort((poles.imag, np.abs(poles)))]

    def mode(self, name: str) -> Mode:
        """Mode of a name.

        Raises
        ------
        KeyError
            There is none; the message lists those that there are.
        """
        for mode in self.modes:
            if mode.name == name:
                return mode
        raise KeyError(f"no mode {name!r}: there are {', '.join(mode.name for mode in self.modes)}")

    def quasi_static(self, kept: Sequence[str] = S.LINEAR_BODY_NAMES) -> LinearModel:
        """Model in which all states but the kept ones have settled: A_ss - A_sf A_ff^-1 A_fs and so on.

        Parameters
        ----------
        kept : sequence of str
            Names of states; the order of the result is theirs.

        Raises
        ------
        LinearizationError
            A name that the model does not have, or states that do not settle (A_ff is singular).
        """
        if isinstance(self.trim, StandPoint) and kept is S.LINEAR_BODY_NAMES:
            raise LinearizationError(
                "body.stand: the states of a body in flight, to which models are reduced, are locked"
            )
        missing = [name for name in kept if name not in self.state_names]
        if missing:
            raise LinearizationError(f"kept = {missing[0]}: allowed are {', '.join(self.state_names)}")
        slow = [self.state_names.index(name) for name in kept]
        fast = [i for i in range(len(self.state_names)) if i not in slow]
        reduced_a, reduced_b, by_state, by_control = settle(self.a, self.b, slow)
        controls = np.arange(len(self.control_names)) + len(self.state_names)
        return replace(
            self,
            a=reduced_a,
            b=reduced_b,
            c=self.c[:, slow] + product(self.c[:, fast], by_state),
            d=self.d + product(self.c[:, fast], by_control),
            state_names=tuple(kept),
            state_units=tuple(self.state_units[i] for i in slow),
            steps=self.steps[[*slow, *controls]],
            spread=self.spread[np.ix_(slow, [*slow, *controls])],
        )

    @cached_property
    def control_effects(self) -> tuple[ControlEffect, ...]:
        """Which way more of each control moves the aircraft at once, rotors and inflow settled; none on a stand.

        Raises
        ------
        LinearizationError
            The model has not all states of the body, or its other states do not settle.
        """
        if isinstance(self.trim, StandPoint):
            return ()
        return control_effects(self.quasi_static().b, S.LINEAR_BODY_NAMES, self.control_names, self.control_axes)

    def derivatives(self, quasi_static: bool = True) -> dict[str, float]:
        """Stability and control derivatives, normalised as in Padfield, Helicopter Flight Dynamics, section 4A.2.

        Parameters
        ----------
        quasi_static : bool
            Rotors and inflow settled (what a rigid-body model has), or held (the blocks A_B-B and B of the body).

        Returns
        -------
        dict of str to float
            "X_u" ... "N'_r" and "X_collective" ...: force over mass, moments after the inverse inertia matrix (the
            primed ones), SI units and radians, without the terms of turning axes and gravity.
        """
        model = self.quasi_static() if quasi_static else self
        body = [model.state_names.index(name) for name in S.LINEAR_BODY_NAMES]
        loads = model.a[np.ix_(body, body)] - self.kinematics
        found = {}
        for row, equation in enumerate(S.LINEAR_BODY_NAMES):
            symbol = FORCES.get(equation) or MOMENTS.get(equation)
            if symbol is None:
                continue
            for motion in MOTIONS:
                found[f"{symbol}_{motion}"] = float(loads[row, S.LINEAR_BODY_NAMES.index(motion)])
            for column, control in enumerate(model.control_names):
                found[f"{symbol}_{control}"] = float(model.b[body[row], column])
        return found

    def frequency_response(
        self,
        input_name: str,
        output_name: str,
        frequencies: Any = None,
        delay: float = 0.0,
        actuator: Actuator | None = None,
    ) -> FrequencyResponse:
        """Gain and phase of an output or state over frequency; see `sbs_sim.analysis.frequency_response`.

        Parameters
        ----------
        input_name, output_name : str
            A control, and an output or state.
        frequencies : array_like, optional
            Rising [rad/s]; by default 200 that show all poles.
        delay : float
            Of sensors, computers and the like [s].
        actuator : Actuator, optional
            Between the control and the model.

        Raises
        ------
        LinearizationError
            A name that the model does not have, or frequencies or a delay out of range.
        """
        return frequency_response(self, input_name, output_name, frequencies, delay, actuator)

    def bandwidth(
        self,
        input_name: str,
        output_name: str,
        delay: float = 0.0,
        is_rate_command: bool = True,
        actuator: Actuator | None = None,
    ) -> Bandwidth:
        """Bandwidth and phase delay of an attitude after ADS-33E-PRF; see `sbs_sim.analysis.bandwidth`.

        Raises
        ------
        LinearizationError
            A name that the model does not have, a delay out of range, or an output that the control does not move.
        """
        return bandwidth(self, input_name, output_name, delay, is_rate_command, actuator)

    def save(self, path: str | Path) -> None:
        """Write the model to a file of the kind that its suffix says.

        Parameters
        ----------
        path : str or Path
            ".npz": arrays by name, what belongs to the trim and the blocks as "trim.pitch", "blocks.A_B-B".
            ".mat": the same for Matlab and Octave, trim and blocks as structures, names as cells; what an identifier
            cannot hold is an underscore there. ".json": see `to_dict`. ".h": matrices as a C header.

        Raises
        ------
        ExportError
            Another suffix, or a file that cannot be written.
        """
        path = checks.path("path", path, ExportError)
        check_target(path, export.ENCODERS)
        write(path, export.ENCODERS[path.suffix.lower()](self))

    def to_control(self) -> Any:
        """`control.StateSpace` of python-control with the names of states, inputs and outputs.

        Raises
        ------
        ExportError
            python-control is not installed.
        """
        return export.to_control(self)

    def to_dict(self) -> dict[str, Any]:
        """Everything as plain lists and numbers for JSON, see `sbs_sim.analysis.export.model_to_dict`."""
        return export.model_to_dict(self)

    def _repr_html_(self) -> str:
        return model_html(self)


def growing_rotor_modes_text(model: LinearModel, aircraft: Aircraft) -> str:
    """Rotor modes of a linear model that grow, with their poles and the names of the rotors; "none" without any."""
    said = []
    for mode in model.growing_rotor_modes:
        imaginary = f" ± {mode.pole.imag:.5g}i" if mode.is_oscillatory else ""
        names = ", ".join(aircraft.rotors[number - 1].name for number in mode.rotors)
        said.append(f"{mode.name} at {mode.pole.real:.3g}{imaginary} rad/s ({names})")
    return "; ".join(said) or "none"


def settle(a: Array, b: Array, slow: Sequence[int]) -> tuple[Array, Array, Array, Array]:
    """Quasi-static reduction: all states but the slow ones have settled (theory.md eq. 9.3).

    Parameters
    ----------
    a : ndarray, shape (n, n)
    b : ndarray, shape (n, m)
    slow : sequence of int
        Indices of the s states that are kept, in the order of the result.

    Returns
    -------
    a, b : ndarray, shape (s, s) and (s, m)
        Of the slow states alone.
    by_state, by_control : ndarray, shape (n - s, s) and (n - s, m)
        The settled states are by_state @ slow states + by_control @ controls.

    Raises
    ------
    LinearizationError
        They do not settle: their matrix is singular.
    """
    fast = [i for i in range(len(a)) if i not in slow]
    try:
        settled = -solve(a[np.ix_(fast, fast)], np.hstack([a[fast][:, slow], b[fast]]))
    except np.linalg.LinAlgError:
        raise LinearizationError("the states that are not kept do not settle: their matrix is singular") from None
    by_state, by_control = settled[:, : len(slow)], settled[:, len(slow) :]
    coupling = a[np.ix_(slow, fast)]
    reduced = a[np.ix_(slow, slow)] + product(coupling, by_state)
    return reduced, b[slow] + product(coupling, by_control), by_state, by_control
