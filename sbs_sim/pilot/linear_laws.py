"""The controllers of this package as linear laws in continuous time, to close loops of linear models with them.

Within their limits; what a tick samples is a delay of half a tick beside that of the computer.
"""

from __future__ import annotations  # `help` then shows types by their names

import math
from collections.abc import Sequence

import numpy as np

from sbs_sim.analysis.linear_loop import LinearLaw
from sbs_sim.analysis.linear_model import LinearModel
from sbs_sim.errors import PilotError
from sbs_sim.flight import measured as M
from sbs_sim.pilot.augmentation import FED_BACK, Augmentation, augmentation
from sbs_sim.pilot.envelope import PERIOD, Envelope
from sbs_sim.pilot.feedback import Compensator
from sbs_sim.pilot.hover_hold import FILTER_TIME, HELD, MEASURED, HoverHoldDesign, HoverModel, design, pilot_axes

AXES = ("heave", "roll", "pitch", "yaw")
PATHS = {"north": "forward", "east": "right", "psi": "heading"}  # names of a loop for those of what is measured


def augmentation_law(model: LinearModel, found: Augmentation | None = None) -> LinearLaw:
    """Augmentation about the flight of a linear model: sticks command attitudes in pitch and roll, a rate in yaw.

    Commands are "heave stick" and so on, in the units of their controls.

    Raises
    ------
    PilotError
        See `sbs_sim.pilot.augmentation.augmentation`, which designs it if none is given.
    """
    own = augmentation(model) if found is None else found
    axes, one = pilot_axes(model.control_axes, model.control_units), np.eye(len(AXES))
    return LinearLaw(
        a=-(one + own.lag_gains) / FILTER_TIME,
        b=np.hstack([-own.gains / FILTER_TIME, np.zeros((len(AXES),) * 2)]),
        c=one,
        d=np.hstack([np.zeros_like(own.gains), np.diag(own.senses)]),
        measured=FED_BACK,
        commands=tuple(f"{axis} stick" for axis in AXES),
        axes=AXES,
        controls=tuple(model.control_names[i] for i in axes),
        rate_axes=("yaw",),
    )


def hover_hold_law(model: LinearModel, found: HoverHoldDesign | None = None) -> LinearLaw:
    """Hover hold: commands are targets of position and heading, "forward target" and so on.

    Raises
    ------
    PilotError
        See `sbs_sim.pilot.hover_hold.design`, which designs it if none is given.
    """
    own = design(HoverModel.of(model)) if found is None else found
    axes = pilot_axes(model.control_axes, model.control_units)
    n, held, m = len(MEASURED), len(HELD), len(AXES)
    by_measured, by_integral, by_lag = np.split(own.gains, [n, n + held], axis=1)
    target = np.hstack([np.zeros((held, n - held)), -np.eye(held)])  # what a target takes from what is measured
    lagged = np.hstack([-by_measured, -by_measured @ target.T]) / FILTER_TIME
    integrals = np.hstack([np.zeros((held, n - held)), np.eye(held), -np.eye(held)])
    return LinearLaw(
        a=np.block([[np.zeros((held, held + m))], [-by_integral / FILTER_TIME, -(np.eye(m) + by_lag) / FILTER_TIME]]),
        b=np.vstack([integrals, lagged]),
        c=np.hstack([np.zeros((m, held)), np.eye(m)]),
        d=np.zeros((m, n + held)),
        measured=MEASURED,
        commands=tuple(f"{name} target" for name in HELD),
        axes=("",) * held,
        controls=tuple(model.control_names[i] for i in axes),
    )


def sampled_law(
    found: Compensator,
    tick: float,
    measured: Sequence[str],
    commands: Sequence[str],
    axes: Sequence[str],
    controls: Sequence[str],
) -> LinearLaw:
    """Law of continuous time of one that runs once a tick, by the bilinear transformation (A. Tustin 1947).

    Right up to frequencies of about 1 / tick. That controls are held for a tick is half a tick of delay beside it.

    Parameters
    ----------
    found : Compensator
        Its inputs are what is measured, then the commands.
    tick : float
        [s]
    measured, commands, axes, controls : sequence of str
        See `LinearLaw`.
    """
    back = np.linalg.inv(found.a + np.eye(len(found.a)))
    root = 2.0 / math.sqrt(tick)
    return LinearLaw(
        a=2.0 / tick * (found.a - np.eye(len(found.a))) @ back,
        b=root * back @ found.b,
        c=root * found.c @ back,
        d=found.d - found.c @ back @ found.b,
        measured=tuple(measured),
        commands=tuple(commands),
        axes=tuple(axes),
        controls=tuple(controls),
    )


def attitude_law(model: LinearModel, found: Envelope) -> LinearLaw:
    """Envelope controller near the flight of a linear model, with attitudes commanded: pitch and roll.

    Raises
    ------
    PilotError
        It was designed for another aircraft.
    """
    if found.parameter_hash != model.parameter_hash:
        raise PilotError(
            f"the controller is one of {found.aircraft} with other parameters: allowed is one for this aircraft"
        )
    airspeed = model.trim.condition.airspeed
    answer, asked = found.compensator(airspeed, is_attitude=True), found.command_response(airspeed)
    count = M.U_AIR  # what it measures against the air follows from what it measures over ground
    more = np.zeros((len(asked.a) - len(answer.a), count))
    whole = Compensator(
        asked.a,
        np.hstack([np.vstack([answer.b[:, :count], more]), asked.b]),
        asked.c,
        np.hstack([answer.d[:, :count], asked.d]),
    )
    names = [PATHS.get(name, name) for name in M.NAMES[:count]]
    controls = [found.control_names[i] for i in found.axes]
    return sampled_law(whole, PERIOD, names, ("pitch command", "roll command"), ("pitch", "roll"), controls)
