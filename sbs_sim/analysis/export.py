"""Trims and linear models as files and for other programs: .npz, .mat, .json, python-control.

Names and places are those of `TrimPoint` and `LinearModel`, SI units and radians; poles, modes and blocks come along.
"""

import csv
import errno
import io
import json
import math
import os
import re
import shutil
import uuid
from collections.abc import Callable, Collection, Mapping
from contextlib import suppress
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sbs_sim import checks
from sbs_sim.errors import ExportError
from sbs_sim.model.state import CONTROL_NAMES

if TYPE_CHECKING:
    from sbs_sim.analysis.linearize import LinearModel
    from sbs_sim.analysis.modes import Mode
    from sbs_sim.analysis.sweep import Sweep
    from sbs_sim.analysis.trim import TrimPoint


def save(model: "LinearModel", path: str | Path) -> None:
    """Write a linear model to a file of the kind that its suffix says.

    Parameters
    ----------
    model : LinearModel
    path : str or Path
        ".npz": arrays by name, what belongs to the trim and the blocks as "trim.pitch", "blocks.A_B-B".
        ".mat": the same for Matlab and Octave, trim and blocks as structures, names as cells; what an identifier
        cannot hold is an underscore there. ".json": see `model_to_dict`.

    Raises
    ------
    ExportError
        Something else than a linear model, another suffix, or a file that cannot be written.
    """
    from sbs_sim.analysis.linearize import LinearModel

    checks.instance("model", model, LinearModel, ExportError)
    path = checks.path("path", path, ExportError)
    check_target(path, ENCODERS)
    write(path, ENCODERS[path.suffix.lower()](model))


def write(path: str | Path, content: bytes | str) -> None:
    """Write a file, whole or not at all; a text in UTF-8. An older one is replaced, devices and pipes are written to.

    Raises
    ------
    ExportError
        It cannot be written: the message says why, and what was there before is still there.
    """
    path = Path(path)
    data = content.encode() if isinstance(content, str) else content
    try:
        if path.is_file() or not path.exists():
            _replace(path, data)
        else:
            path.write_bytes(data)
    except (OSError, ValueError) as error:  # the latter for names that no file can have
        reason = f"there is no folder {_named(path.parent)}" if _no_folder(path.parent) else _reason(error)
        raise ExportError(f"{_named(path)}: cannot be written: {reason}") from None


def _replace(path: Path, data: bytes) -> None:
    """Write beside the file, and put that into its place."""
    with suppress(FileNotFoundError), path.open("r+b"):  # a protected file, or a name that cannot be, ends here
        pass
    path = path.resolve()  # a link stays one
    beside = path.with_name(f".{uuid.uuid4().hex}")
    try:
        beside.write_bytes(data)
        if path.exists():
            shutil.copymode(path, beside)
        beside.replace(path)
    except BaseException:
        with suppress(OSError):
            beside.unlink()
        raise


def check_target(path: str | Path | None, suffixes: Collection[str] = ()) -> None:
    """Raise what `write` would, as far as it can be known before the work of which it is to keep the result.

    Parameters
    ----------
    path : str or Path, optional
        None is fine.
    suffixes : collection of str
        Those that are allowed; all if empty.

    Raises
    ------
    ExportError
        Another suffix, or no folder to write in.
    """
    if path is None:
        return
    path = Path(path)
    if suffixes and path.suffix.lower() not in suffixes:
        raise ExportError(f"{_named(path)}: allowed are names that end in {', '.join(suffixes)}")
    if _no_folder(path.parent):
        raise ExportError(f"{_named(path)}: cannot be written: there is no folder {_named(path.parent)}")
    if os.path.isfile(path.parent):  # pathlib's raises for names that cannot be
        raise ExportError(f"{_named(path)}: cannot be written: {os.strerror(errno.ENOTDIR)}")


def _named(path: Path) -> str:
    """A path with its control characters as Python writes them: a refusal is one line."""
    return "".join(letter if letter.isprintable() else repr(letter)[1:-1] for letter in str(path))


def _no_folder(folder: Path) -> bool:
    try:
        return not folder.exists()
    except (OSError, ValueError):
        return False


def _reason(error: Exception) -> str:
    return str(getattr(error, "strerror", None) or error)


def to_json(data: Any) -> str:
    """Text of a mapping as JSON; see `plain`."""
    return json.dumps(plain(data), allow_nan=False) + "\n"


def plain(value: Any) -> Any:
    """Numbers, texts, lists and mappings of them for JSON.

    Arrays and tuples become lists, complex numbers {"real", "imag"}, and None is what is not finite.
    """
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        numbers = value.tolist()
        # the long way for each number is slow where there are thousands
        is_plain = value.dtype.kind in "biu" or (value.dtype.kind == "f" and bool(np.isfinite(value).all()))
        return numbers if is_plain else plain(numbers)
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, complex):
        return {"real": plain(value.real), "imag": plain(value.imag)}
    return None if isinstance(value, float) and not math.isfinite(value) else value


def trim_to_dict(point: "TrimPoint") -> dict[str, Any]:
    """Trim as plain lists and numbers, by the names of `TrimPoint`; with "control_names"."""
    return dict(plain(_trim_contents(point)))


def model_to_dict(model: "LinearModel", with_trim: bool = True) -> dict[str, Any]:
    """Linear model as plain lists and numbers, by the names of `LinearModel`.

    Parameters
    ----------
    model : LinearModel
    with_trim : bool
        False leaves the trim out.

    Returns
    -------
    dict
        With "poles" as {"real", "imag"} [rad/s], and "modes" as mappings with name, family, rotors, real, imag [rad/s],
        frequency [rad/s], damping, period, time_to_half, time_to_double [s, None where there is none], participation;
        "growing_rotor_modes" has the names of those.
    """
    contents = {name: value for name, value in _contents(model).items() if not name.startswith("mode_")}
    if not with_trim:
        del contents["trim"]
    return dict(plain({**contents, "modes": [_mode_contents(mode) for mode in model.modes]}))


def to_control(model: "LinearModel") -> Any:
    """Linear model as a `control.StateSpace` of python-control, with names of states, inputs and outputs.

    Raises
    ------
    ExportError
        python-control is not installed.
    """
    try:
        from control import StateSpace  # here, because it is slow to import and optional
    except ImportError:
        raise ExportError("python-control is not installed; remedy: pip install control") from None
    return StateSpace(
        *(model.a, model.b, model.c, model.d),
        states=list(model.state_names),
        inputs=list(model.control_names),
        outputs=list(model.output_names),
    )


# --- what a file holds ------------------------------------------------------------------------------------------


def _fields(record: Any) -> dict[str, Any]:
    return {field.name: getattr(record, field.name) for field in fields(record)}


def _trim_contents(point: "TrimPoint") -> dict[str, Any]:
    return {**_fields(point), "condition": _fields(point.condition), "control_names": CONTROL_NAMES}


def _mode_contents(mode: "Mode") -> dict[str, Any]:
    names = ("frequency", "damping", "period", "time_to_half", "time_to_double", "participation")
    named = {"name": mode.name, "family": mode.family, "rotors": mode.rotors}
    pole = {"real": mode.pole.real, "imag": mode.pole.imag}
    return {**named, **pole, **{name: getattr(mode, name) for name in names}}


def _contents(model: "LinearModel") -> dict[str, Any]:
    """Everything by name: arrays, numbers, texts, tuples of texts, and mappings of these."""
    return {
        **_fields(model),
        "warnings": model.warnings,
        "trim": _trim_contents(model.trim),
        "poles": model.poles,
        "mode_names": tuple(mode.name for mode in model.modes),
        "mode_poles": np.array([mode.pole for mode in model.modes]),
        "mode_participation": np.array([mode.participation for mode in model.modes]),
        "growing_rotor_modes": tuple(mode.name for mode in model.growing_rotor_modes),
    }


def _npz(model: "LinearModel") -> bytes:
    """Flat names and no pickled objects, so that `numpy.load` reads it as it is."""
    flat: dict[str, Any] = {}

    def add(prefix: str, contents: Mapping[str, Any]) -> None:
        for name, value in contents.items():
            if isinstance(value, Mapping):
                add(f"{prefix}{name}.", value)
            else:
                flat[f"{prefix}{name}"] = np.array(value, dtype=str) if _is_names(value) else np.asarray(value)

    add("", _contents(model))
    file = io.BytesIO()
    np.savez_compressed(file, **flat)
    return file.getvalue()


def _mat(model: "LinearModel") -> bytes:
    from scipy.io import savemat

    file = io.BytesIO()
    savemat(file, _for_matlab(_contents(model)), long_field_names=True, oned_as="column", do_compression=True)
    return file.getvalue()


def _for_matlab(contents: Mapping[str, Any]) -> dict[str, Any]:
    """Mappings as structures with names that Matlab allows, names as cells."""
    result = {}
    for name, value in contents.items():
        if isinstance(value, Mapping):
            value = _for_matlab(value)
        elif _is_names(value):
            value = np.array(value, dtype=object)
        result[re.sub(r"\W", "_", name)] = value
    return result


def _is_names(value: Any) -> bool:
    return isinstance(value, tuple) and all(isinstance(item, str) for item in value)


def _json(model: "LinearModel") -> bytes:
    return to_json(model_to_dict(model)).encode()


ENCODERS: dict[str, Callable[["LinearModel"], bytes]] = {".npz": _npz, ".mat": _mat, ".json": _json}


def sweep_to_csv(sweep: "Sweep") -> str:
    """Table of a sweep: one row for each point, SI units and radians; cells are empty where a point has none.

    Columns: the parameter, attitude, controls, thrust, torque and power of each rotor, the states, the poles of the
    modes by name, where the model does not hold, the error.
    """
    columns = {f"{sweep.parameter} [{sweep.unit(sweep.parameter)}]": sweep.values}
    for name in sweep.names:
        values, unit = sweep[name], sweep.unit(name)
        if values.ndim == 1:
            columns[f"{name} [{unit}]"] = values
        else:
            columns |= {f"{name}({j + 1}) [{unit}]": column for j, column in enumerate(values.T)}
    for name, locus in sweep.loci.items():
        columns |= {f"{name}: real [rad/s]": locus.real, f"{name}: imaginary [rad/s]": locus.imag}
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow([*columns, "warnings", "error"])
    for i, point in enumerate(sweep.points):
        cells = ["" if math.isnan(column[i]) else repr(float(column[i])) for column in columns.values()]
        writer.writerow([*cells, "; ".join(point.warnings), point.error or ""])
    return file.getvalue()
