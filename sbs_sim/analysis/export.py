"""Trims and linear models as files and for other programs: .npz, .mat, .json, C headers, python-control.

Names and order are those of `TrimPoint` and `LinearModel`, SI units and radians; poles, modes and blocks come along.
"""

import csv
import io
import math
import re
from collections.abc import Callable, Mapping
from dataclasses import fields
from typing import TYPE_CHECKING, Any

import numpy as np

from sbs_sim.errors import ExportError
from sbs_sim.output.json_text import plain, to_json

if TYPE_CHECKING:
    from sbs_sim.analysis.linear_model import LinearModel
    from sbs_sim.analysis.modes import Mode
    from sbs_sim.analysis.reduced import ReducedModel
    from sbs_sim.analysis.sweep import Sweep


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


def to_control(model: "LinearModel | ReducedModel") -> Any:
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
        "trim": model.trim.contents(),
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
                flat[f"{prefix}{name}"] = value

    add("", _contents(model))
    return _npz_file(flat)


def _npz_file(content: dict[str, Any]) -> bytes:
    arrays: dict[str, Any] = {
        name: np.array(value, dtype=str) if _is_names(value) else np.asarray(value) for name, value in content.items()
    }
    file = io.BytesIO()
    np.savez_compressed(file, **arrays)
    return file.getvalue()


def _mat(model: "LinearModel") -> bytes:
    return _mat_file(_contents(model))


def _mat_file(content: dict[str, Any]) -> bytes:
    from scipy.io import savemat

    file = io.BytesIO()
    savemat(file, _for_matlab(content), long_field_names=True, oned_as="column", do_compression=True)
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


def c_header(model: "LinearModel | ReducedModel") -> str:
    """Matrices, and names and units as comments, as a header for C99 and C++; nothing in it is computed.

    Rows of a matrix are rows of the array. An identifier begins with `sbs_model_`.
    """
    sizes = {"STATES": len(model.a), "INPUTS": model.b.shape[1], "OUTPUTS": len(model.c)}
    lines = [
        "/* Linear model x' = A x + B u, y = C x + D u for small departures from a trim, written by sbs_sim.",
        " * SI units and radians. Rows of A and B are states, of C and D outputs; columns are states or inputs. */",
        "#ifndef SBS_MODEL_H",
        "#define SBS_MODEL_H",
        "",
        *(f"#define SBS_MODEL_{name} {value}" for name, value in sizes.items()),
    ]
    ends = {
        "states": (model.state_names, model.state_units),
        "inputs": (model.control_names, model.control_units),
        "outputs": (model.output_names, model.output_units),
    }
    for what, (names, units) in ends.items():
        lines += ["", f"/* {what}: index, name [unit]"]
        lines += [
            f" * {i} {_comment(name)} [{_comment(unit)}]"
            for i, (name, unit) in enumerate(zip(names, units, strict=True))
        ]
        lines[-1] += " */"
    shapes = {
        "a": ("STATES", "STATES"),
        "b": ("STATES", "INPUTS"),
        "c": ("OUTPUTS", "STATES"),
        "d": ("OUTPUTS", "INPUTS"),
    }
    for name, (rows, columns) in shapes.items():
        lines += ["", f"static const double sbs_model_{name}[SBS_MODEL_{rows}][SBS_MODEL_{columns}] = {{"]
        lines += [f"    {{{', '.join(repr(value) for value in row)}}}," for row in getattr(model, name).tolist()]
        lines += ["};"]
    return "\n".join([*lines, "", "#endif /* SBS_MODEL_H */", ""])


def _comment(text: str) -> str:
    """A name from a file, which must not end a comment."""
    return re.sub(r"[^\w(). ^/'\[\]-]", "_", text)


def _header(model: "LinearModel | ReducedModel") -> bytes:
    return c_header(model).encode()


def _small(model: "ReducedModel") -> dict[str, Any]:
    return {**_fields(model), "poles": model.poles}


def _small_npz(model: "ReducedModel") -> bytes:
    return _npz_file(_small(model))


def _small_mat(model: "ReducedModel") -> bytes:
    return _mat_file(_small(model))


def _small_json(model: "ReducedModel") -> bytes:
    return to_json(_small(model)).encode()


ENCODERS: dict[str, Callable[["LinearModel"], bytes]] = {".npz": _npz, ".mat": _mat, ".json": _json, ".h": _header}
STATE_SPACE_ENCODERS: dict[str, Callable[["ReducedModel"], bytes]] = {
    ".npz": _small_npz,
    ".mat": _small_mat,
    ".json": _small_json,
    ".h": _header,
}


def sweep_to_csv(sweep: "Sweep") -> str:
    """Table of a sweep: one row for each point, SI units and radians; cells are empty where a point has none.

    Columns: the parameter, attitude, controls, thrust, torque, power and speed of each rotor, the states, the poles of
    the modes by name, where the model does not hold, the error.
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
