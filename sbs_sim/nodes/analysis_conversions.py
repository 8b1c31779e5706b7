"""Trim points, linear models and sweeps as messages."""

import numpy as np
from numpy.typing import NDArray

from sbs_msgs.msg import (
    LinearModel,
    Mode,
    NamedMatrix,
    SweepPoint,
    TrimCondition,
    TrimPoint,
)
from sbs_sim.aircraft import Aircraft
from sbs_sim.analysis import linearize, modes, sweep, trim
from sbs_sim.flight.engine import Engine
from sbs_sim.flight.records import Snapshot
from sbs_sim.flight.trimmed_state import trimmed_state
from sbs_sim.model.average import azimuths
from sbs_sim.nodes.conversions import (
    StateMessages,
    axis_controls_message,
    command_fields,
    float64_array,
    swashplate_messages,
)

Array = NDArray[np.float64]


def trim_message(aircraft: Aircraft, point: trim.TrimPoint) -> TrimPoint:
    """Message of a trim."""
    rotors = StateMessages(aircraft)
    rotors.fill(_mean_snapshot(aircraft, point))
    return TrimPoint(
        condition=_condition_message(point),
        controls=axis_controls_message(aircraft, point.controls),
        roll=point.roll,
        pitch=point.pitch,
        swashplate=swashplate_messages(point.swashplate[: len(aircraft.rotors)]),
        **command_fields(aircraft, point.swashplate),
        rotors=rotors.rotors.rotors,
        inflow=rotors.inflow.rotors,
        state_names=point.state_names,
        state=float64_array(point.state),
        thrust=float(point.thrust.sum()),
        power=float(point.power.sum()),
        residual=point.residual,
        iterations=point.iterations,
        inner_iterations=point.inner_iterations,
        beyond_limits=point.beyond_limits,
        warnings=point.warnings,
    )


def _condition_message(point: trim.TrimPoint) -> TrimCondition:
    condition = point.condition
    return TrimCondition(
        airspeed=float(condition.airspeed),
        climb_rate=float(condition.climb_rate),
        sideslip=float(condition.sideslip),
        turn_rate=float(condition.turn_rate),
        lead_lag=point.lead_lag,
        cyclic_inflow=point.cyclic_inflow,
        azimuth_count=point.azimuth_count,
        method=point.method,
    )


def _mean_snapshot(aircraft: Aircraft, point: trim.TrimPoint) -> Snapshot:
    """Trim as the instant at which the first blades are aft, with the mean loads of a revolution."""
    count = len(aircraft.rotors)
    state = trimmed_state(aircraft, point)
    engine = Engine(aircraft.arranged(point.lead_lag, point.cyclic_inflow, "points"))
    _, loads = engine.average(state, point.swashplate, azimuths(aircraft.passages, point.azimuth_count))
    return Snapshot(
        step=0,
        time=0.0,
        state=state,
        acceleration=np.zeros(3),
        swashplate=point.swashplate,
        azimuth=np.zeros(count),
        loads=loads,
        wind=np.zeros(3),
    )


def model_message(aircraft: Aircraft, model: linearize.LinearModel) -> LinearModel:
    """Message of a linear model with its modes."""
    return LinearModel(
        state_names=model.state_names,
        state_units=model.state_units,
        control_names=model.control_names,
        control_units=model.control_units,
        a=float64_array(model.a),
        b=float64_array(model.b),
        output_names=model.output_names,
        output_units=model.output_units,
        c=float64_array(model.c),
        d=float64_array(model.d),
        trim=trim_message(aircraft, model.trim),
        modes=[_mode_message(mode) for mode in model.modes],
        azimuth_spread=model.azimuth_spread,
        steps=float64_array(model.steps),
        method=model.method,
        parameter_hash=model.parameter_hash,
        blocks=[_matrix_message(name, matrix) for name, matrix in model.blocks.items()],
        warnings=model.warnings,
    )


def _mode_message(mode: modes.Mode) -> Mode:
    return Mode(
        name=mode.name,
        real=mode.pole.real,
        imag=mode.pole.imag,
        frequency=mode.frequency,
        damping=mode.damping,
        time_to_half=mode.time_to_half,
        time_to_double=mode.time_to_double,
        participation=float64_array(mode.participation),
    )


def _matrix_message(name: str, matrix: Array) -> NamedMatrix:
    rows, columns = matrix.shape
    return NamedMatrix(name=name, rows=rows, columns=columns, data=float64_array(matrix))


def sweep_messages(aircraft: Aircraft, swept: sweep.Sweep) -> list[SweepPoint]:
    """Messages of all points of a sweep, with or without a result."""
    return [_sweep_point_message(_aircraft_at(aircraft, swept.parameter, point), point) for point in swept.points]


def _aircraft_at(aircraft: Aircraft, parameter: str, point: sweep.SweepPoint) -> Aircraft:
    """Aircraft of a point: another one where a value of its file is swept."""
    if parameter in sweep.CONDITIONS or point.trim is None:
        return aircraft
    return aircraft.with_value(parameter, point.value)


def _sweep_point_message(aircraft: Aircraft, point: sweep.SweepPoint) -> SweepPoint:
    message = SweepPoint(value=point.value, success=point.error is None, message=point.error or "")
    message.warnings = point.warnings
    if point.trim is not None:
        message.trim = trim_message(aircraft, point.trim)
    if point.model is not None:
        message.model = model_message(aircraft, point.model)
    return message
