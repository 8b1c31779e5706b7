"""Files of stitched models: .npz with the aircraft in it, which `numpy.load` reads as it is."""

from __future__ import annotations  # `help` then shows types by their names

import io
import json
import tempfile
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sbs_sim import checks
from sbs_sim.aircraft import Aircraft
from sbs_sim.errors import AircraftError, ExportError, SimulationError
from sbs_sim.flight.stitched import StitchedModel
from sbs_sim.model.stitched import DOWN_SIZE, MOTION_SIZE
from sbs_sim.output.files import check_target, write

FORMAT, VERSION = "sbs_sim stitched model", 1
SUFFIX = ".npz"
AIRFOIL = "airfoil."  # prefix of the contents of its files
LARGEST = 1 << 30  # bytes of an array
NUMBERS = (
    *("airspeeds", "climb_rates", "trims", "trim_slopes", "matrices", "output_trims", "output_slopes"),
    *("output_matrices", "residuals"),
)


def save(model: StitchedModel, path: str | Path) -> None:
    """Write a stitched model to a file, with its aircraft, names and units.

    Parameters
    ----------
    model : StitchedModel
    path : str or Path
        Ends in ".npz".

    Raises
    ------
    ExportError
        Another suffix, or a file that cannot be written.
    """
    path = checks.path("path", path, ExportError)
    check_target(path, [SUFFIX])
    write(path, encoded(model))


def encoded(model: StitchedModel) -> bytes:
    """Contents of the file of a stitched model."""
    try:
        data, files = model.aircraft.files()
    except AircraftError as error:
        raise ExportError(f"the stitched model cannot be written: {error}") from None
    texts = {
        "format": FORMAT,
        "aircraft": model.aircraft.name,
        "aircraft_file": json.dumps(data),
        "parameter_hash": model.aircraft.parameter_hash,
    }
    names = {
        "z_names": model.z_names,
        "z_units": model.z_units,
        "output_names": model.output_names,
        "output_units": model.output_units,
        "kept": model.kept,
        "control_names": model.aircraft.control_names,
        "warnings": model.warnings,
    }
    contents: dict[str, Any] = {name: np.array(text) for name, text in texts.items()}
    contents |= {name: np.array(values, dtype=str) for name, values in names.items()}
    contents |= {name: getattr(model, name) for name in (*NUMBERS, "inputs")}
    contents |= {
        "format_version": np.array(VERSION),
        "lead_lag": np.array(model.lead_lag),
        "cyclic_inflow": np.array(model.cyclic_inflow),
        "azimuth_count": np.array(model.azimuth_count),
        "fastest": np.array(model.fastest),
        "mixing": model.aircraft.mixing,
    }
    contents |= {AIRFOIL + name: np.frombuffer(content, dtype=np.uint8) for name, content in files.items()}
    file = io.BytesIO()
    np.savez_compressed(file, **contents)
    return file.getvalue()


def load(path: str | Path) -> StitchedModel:
    """Read a stitched model.

    Raises
    ------
    SimulationError
        The file cannot be read, or is none of a stitched model.
    """
    path = checks.path("path", path, SimulationError)
    try:
        content = path.read_bytes()
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise SimulationError(f"stitched model {str(path)!r}: cannot be read: {reason}") from None
    return decoded(content, repr(str(path)))


def decoded(content: bytes, what: str) -> StitchedModel:
    """Stitched model of the contents of a file that a message calls `what`."""
    try:
        return _model(_arrays(content))
    except KeyError as error:
        raise SimulationError(f"stitched model {what}: {error.args[0]} is missing") from None
    except (zipfile.BadZipFile, ValueError, TypeError, OSError, EOFError, AircraftError, OverflowError) as error:
        text = " ".join(str(error).split())
        raise SimulationError(f"stitched model {what}: no file of a stitched model: {text}") from None


def _arrays(content: bytes) -> dict[str, NDArray[Any]]:
    """Arrays of a file by name, without objects."""
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        sizes = [entry.file_size for entry in archive.infolist()]
    if sum(sizes) > LARGEST:
        raise ValueError(f"it holds {sum(sizes)} bytes: allowed are {LARGEST}")
    with np.load(io.BytesIO(content), allow_pickle=False) as file:
        return {name: file[name] for name in file.files}


def _model(arrays: Mapping[str, NDArray[Any]]) -> StitchedModel:
    """Checked model of the arrays of a file."""
    if str(arrays["format"]) != FORMAT:
        raise ValueError(f"format = {checks.shown(str(arrays['format']))}: allowed is {FORMAT}")
    if int(arrays["format_version"]) != VERSION:
        raise ValueError(f"format_version = {int(arrays['format_version'])}: allowed is {VERSION}")
    aircraft = _aircraft(arrays)
    numbers = {name: np.ascontiguousarray(arrays[name], dtype=float) for name in NUMBERS}
    inputs, kept = arrays["inputs"].astype(np.int64), tuple(map(str, arrays["kept"]))
    for name, values in numbers.items():
        if not np.isfinite(values).all():
            raise ValueError(f"{name} is not finite")
    model = StitchedModel(
        aircraft=aircraft,
        parameter_hash=aircraft.parameter_hash,
        lead_lag=bool(arrays["lead_lag"]),
        cyclic_inflow=bool(arrays["cyclic_inflow"]),
        azimuth_count=int(arrays["azimuth_count"]),
        kept=kept,
        inputs=inputs,
        fastest=checks.number("fastest", float(arrays["fastest"]), 1e-6, 1e6, "rad/s", SimulationError),
        warnings=tuple(map(str, arrays["warnings"])),
        **numbers,
    )
    _check(model)
    return model


def _check(model: StitchedModel) -> None:
    """Raise ValueError for numbers that do not belong together."""
    names, rows = model.aircraft.layout.linear_names, 3 * len(model.aircraft.rows)
    if any(name not in names for name in model.kept) or len(set(model.kept)) != len(model.kept):
        raise ValueError("kept names a state that the aircraft does not have")
    if model.inputs.ndim != 1 or ((model.inputs < 0) | (model.inputs >= rows)).any():
        raise ValueError(f"inputs: allowed are integers from 0 to {rows - 1}")
    shape = len(model.climb_rates), len(model.airspeeds)
    height = MOTION_SIZE + len(model.kept)
    z, outputs = height + len(model.inputs), len(model.output_names)
    wanted = {
        "trims": (*shape, DOWN_SIZE + z),
        "trim_slopes": (*shape, DOWN_SIZE + z),
        "matrices": (*shape, height, z),
        "output_trims": (*shape, outputs),
        "output_slopes": (*shape, outputs),
        "output_matrices": (*shape, outputs, z),
        "residuals": shape,
    }
    for name, allowed in wanted.items():
        if getattr(model, name).shape != allowed:
            raise ValueError(f"{name} has shape {getattr(model, name).shape}: allowed is {allowed}")
    if shape[1] < 2 or shape[0] < 1 or not (np.diff(model.speeds, axis=1) > 0.0).all():
        raise ValueError("the x-velocities of the trims do not rise")


def _aircraft(arrays: Mapping[str, NDArray[Any]]) -> Aircraft:
    """Aircraft of a file; what its airfoils say is kept with it."""
    folder = tempfile.TemporaryDirectory(prefix="sbs_sim-")
    for name, values in arrays.items():
        if name.startswith(AIRFOIL):
            file = Path(folder.name) / Path(name.removeprefix(AIRFOIL)).name  # nowhere else, whatever it is called
            if file.suffix != ".csv":
                raise ValueError(f"{name[:60]!r} is not a .csv file")
            file.write_bytes(values.astype(np.uint8).tobytes())
    aircraft = Aircraft.from_dict(json.loads(str(arrays["aircraft_file"])), Path(folder.name))
    if aircraft.parameter_hash != str(arrays["parameter_hash"]):
        raise ValueError("the aircraft in it is not the one that was stitched: its hash differs")
    aircraft.kept["files of a stitched model"] = folder  # they stay as long as the aircraft
    return aircraft
