"""The memory of a derivative holds all that is written: also where quads of blades do not fill the last register."""

import copy

import numpy as np
import pytest

from sbs_sim import Aircraft
from sbs_sim.flight.engine import Engine
from sbs_sim.model import records as R
from sbs_sim.model.dynamics import derivative
from sbs_sim.model.packing import by_blades

WIDE = 8  # blades to a register: two quads
MARK, MARGIN = 0xA5, 4096  # bytes on either side of every array


def with_rotors(sbs, blades):
    """The default aircraft with rotors of these numbers of blades, side by side."""
    data = copy.deepcopy(sbs.data)
    model = data["rotors"]
    data["rotors"] = [
        {**copy.deepcopy(model[j % 2]), "name": f"R{j}", "blades": count, "blade_mass": 0.05}
        for j, count in enumerate(blades)
    ]
    return Aircraft.from_dict(data, sbs.folder)


def marked(monkeypatch):
    """Let arrays be made with marks around them; what has been made, with its surroundings."""
    made = []

    def aligned(shape, dtype):
        dtype = np.dtype(dtype)
        size = int(np.prod(shape)) * dtype.itemsize
        raw = np.full(size + 2 * MARGIN + 64, MARK, dtype=np.uint8)
        start = MARGIN + -(raw.ctypes.data + MARGIN) % 64
        raw[start : start + size] = 0
        made.append((raw, start, start + size))
        return raw[start : start + size].view(dtype).reshape(shape)

    monkeypatch.setattr(R, "aligned", aligned)
    return made


@pytest.mark.parametrize("blades", [(3,), (5,), (7,), (3, 3, 3), (4, 5, 6), (3, 3, 3, 3, 3), (7, 5)])
def test_nothing_is_written_beside_the_memory_of_a_derivative(sbs, monkeypatch, blades):
    aircraft = with_rotors(sbs, blades)
    rng = np.random.default_rng(len(blades))
    x = np.zeros(aircraft.layout.size)
    x[3], x[7:] = 1.0, 0.02 * rng.normal(size=len(x) - 7)
    swash, psi = 0.1 * rng.normal(size=3 * len(blades)), rng.uniform(0.0, 6.0, len(blades))
    made = marked(monkeypatch)
    found = []
    for model in (by_blades(aircraft.model(), WIDE), aircraft.arranged(True, True, "points")):
        engine = Engine(model)
        given = [np.repeat(part[:, None], engine.n, axis=1) for part in (x, swash, psi, np.ones(3))]
        lanes = [engine.memory(len(part)) for part in given]
        for lane, part in zip(lanes, given, strict=True):
            lane[:] = part
        derivative(engine.model, *lanes, engine.work, engine.tick.slopes[0], True)
        found.append((engine.tick.slopes[0][:, 0].tobytes(), engine.work.load_rows[:, 0].tobytes()))
    assert len(made) > 20
    for raw, start, end in made:
        assert (raw[:start] == MARK).all()
        assert (raw[end:] == MARK).all()
    assert found[0] == found[1]  # flights in the lanes have no register that is not full


def test_marks_would_show_memory_that_is_too_small(sbs, monkeypatch):
    """With room for the quads of the rotors alone, a register of eight blades writes behind it."""
    aircraft = with_rotors(sbs, (3, 3, 3))
    model = by_blades(aircraft.model(), WIDE)
    assert model.indices.azimuth.size == 4
    made = marked(monkeypatch)
    work = R.make_work(model._replace(indices=model.indices._replace(azimuth=model.indices.azimuth[:3])))
    x = R.aligned((aircraft.layout.size, 1), float)
    x[3] = 1.0
    memory = [R.aligned((count, 1), float) for count in (9, 3, 3)]
    derivative(model, x, *memory, work, R.aligned((aircraft.layout.size, 1), float), True)
    assert any((raw[end:] != MARK).any() for raw, _, end in made)
