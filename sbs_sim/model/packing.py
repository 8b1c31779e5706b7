"""Models side by side: one flight with its blades in lanes, or as many flights as there are lanes.

`Aircraft.model` makes the model of one aircraft with a single lane everywhere. Here such models are arranged for the
processor. The bits of a flight do not depend on that, see `sbs_sim.lanes`.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sbs_sim.model.kernel import target
from sbs_sim.model.records import BLADE, ELEMENT, QUAD, Model, StateIndices, aligned

WIDE = "avx512f"  # feature of processors whose registers hold eight numbers


def lane_count() -> int:
    """Numbers side by side in a register of the processor that is compiled for: 8 or 4."""
    _, features = target()
    return 8 if WIDE in features else QUAD


def side_by_side(models: Sequence[Model]) -> Model:
    """Model whose lanes are the flights of some models of one structure.

    Parameters
    ----------
    models : sequence of Model
        Of single aircraft with a single lane, see `Aircraft.model`. What they have in common, integers and airfoil
        tables, is taken from the first.
    """
    first = models[0]
    if len(models) == 1:
        return first
    joined: dict[str, Any] = {
        name: _joined([getattr(model, name) for model in models]) for name in Model._fields if name not in SHARED
    }
    for name, users in TABLES.items():
        tables = [getattr(model, name) for model in models]
        if any(not np.array_equal(table, tables[0]) for table in tables[1:]):
            joined[name] = np.concatenate(tables)
            for user in users:
                joined[user]["first_row"] += np.cumsum([0, *map(len, tables[:-1])])
    return first._replace(**joined)


TABLES = {"shapes": ("surfaces", "fuselages"), "influences": ("pairs",)}  # and the records that have rows in them
SHARED = ("indices", "table", *TABLES)


def _joined(arrays: Sequence[NDArray[Any]]) -> NDArray[Any]:
    """Arrays with one lane as one with as many lanes as there are arrays."""
    first, n = arrays[0], len(arrays)
    if first.dtype.names is None:
        made = aligned((*first.shape[:-1], n), first.dtype)
        for lane, array in enumerate(arrays):
            made[..., lane] = array[..., 0]
        return made
    made = aligned(first.shape, _widened(first.dtype, n))
    for name in first.dtype.names:
        if not first.dtype[name].shape:
            made[name] = first[name]
            continue
        for lane, array in enumerate(arrays):
            made[name][..., lane] = array[name][..., 0]
    return made


def _widened(dtype: np.dtype[Any], n: int) -> np.dtype[Any]:
    """Structured type of the same fields with n lanes."""
    fields = []
    for name in dtype.names or ():
        shape = dtype[name].shape
        fields.append((name, np.float64, (*shape[:-1], n)) if shape else (name, np.int64))
    return np.dtype(fields)


def by_blades(model: Model, width: int) -> Model:
    """Model of one flight whose lanes are blades, 4 or 8 to a register (`width`); 8 may belong to two rotors."""
    quads = _quads(model)
    while len(quads) * QUAD % width:
        quads.append([None] * QUAD)
    lanes = [blade for quad in quads for blade in quad]
    registers = [lanes[i : i + width] for i in range(0, len(lanes), width)]
    blades = aligned(len(registers), _widened(model.blades.dtype, width))
    elements = aligned((len(registers), model.elements.shape[1]), _widened(model.elements.dtype, width))
    knots = aligned((len(registers), model.knots.shape[1], width), float)
    stall = aligned((len(registers), *model.stall.shape[1:-1], width), float)
    for r, register in enumerate(registers):
        _fill_register(model, register, blades[r], elements[r])
        for lane, number in enumerate(_with_copies(register)):
            knots[r, :, lane], stall[r, ..., lane] = model.knots[number, :, 0], model.stall[number, ..., 0]
        blades[r]["quad"], blades[r]["starts_quad"], blades[r]["elements"] = r * width // QUAD, 1, r
        each, count = 2 * QUAD // width, model.elements.shape[1]  # registers of eight blades, sections of one
        blades[r]["separation_first"], blades[r]["separation_stride"] = r // each * count * each + r % each, each
    indices = StateIndices(*(_padded(part, len(quads)) for part in model.indices))
    return model._replace(blades=blades, elements=elements, knots=knots, indices=indices, stall=stall)


def _with_copies(register: Sequence[int | None]) -> list[int]:
    """Numbers of blades; padding is the number of a neighbour."""
    last, found = next(number for number in register if number is not None), []
    for number in register:
        last = last if number is None else number
        found.append(last)
    return found


def _quads(model: Model) -> list[list[int | None]]:
    """Numbers of the blades of every quad, padded with None."""
    quads: list[list[int | None]] = []
    first = 0
    for rotor in model.rotors:
        count = int(rotor["blades"])
        numbers: list[int | None] = [*range(first, first + count), *[None] * (-count % QUAD)]
        quads += [numbers[i : i + QUAD] for i in range(0, len(numbers), QUAD)]
        first += count
    return quads


# Fields that are zero for the blades that pad a quad: these have no mass, no stiffness and no lag.
WEIGHTLESS = (
    *("mass", "first_moment", "hub_second_moment", "inverse_second_moment", "flap_spring", "lag_spring", "lag_damping"),
    "damper_damping",
    *("chord_first", "normal_first", "chord_product", "normal_product"),
    *("chord_second", "mixed_second", "normal_second"),
    *("lead_lag", "alternation", "wake_slow_rate", "wake_fast_rate"),
)


def _fill_register(model: Model, register: Sequence[int | None], blade: Any, elements: NDArray[Any]) -> None:
    """Set blades side by side; padding is a weightless copy of a neighbour."""
    for lane, (number, last) in enumerate(zip(register, _with_copies(register), strict=True)):
        own = model.blades[last]
        for name in BLADE:
            if model.blades.dtype[name].shape:
                blade[name][..., lane] = 0.0 if number is None and name in WEIGHTLESS else own[name][..., 0]
        for name in ELEMENT:
            nothing = number is None and name == "half_area"
            elements[name][:, lane] = 0.0 if nothing else model.elements[own["elements"]][name][:, 0]
    blade["harmonics"] = max(int(model.blades[number]["harmonics"]) for number in _with_copies(register))


def _padded(part: NDArray[Any], quads: int) -> NDArray[Any]:
    """Indices for more quads than there are: those of the last repeated."""
    missing = quads - part.shape[-1]
    return np.concatenate([part, np.repeat(part[..., -1:], missing, axis=-1)], axis=-1)
