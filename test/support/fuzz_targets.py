"""Fuzz targets: the library's functions, its readers and its commands; for `test_fuzz.py` and `fuzz.py`.

A `FuzzTarget` has a hypothesis strategy for its inputs, most of them malformed or extreme, and a check of what comes
of one: the result is sound, or an `SbsError` of one line refuses it. Any other exception, a hang, a file outside the
folder is a failure.
"""

import contextlib
import io
import math
import os
import random
import sys
import tempfile
import threading
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
from helpers import is_finite_model
from hypothesis import strategies as st
from ruamel.yaml import YAML

from sbs_sim import Aircraft, LinearModel, Simulation, linearize, simulate, sweep, trim
from sbs_sim.aircraft.airfoil_files import read_airfoil
from sbs_sim.aircraft.airfoil_files.c81 import c81_text
from sbs_sim.aircraft.airfoil_files.extension import METHODS
from sbs_sim.aircraft.airfoil_files.table import table_of
from sbs_sim.analysis.batch import Case, simulate_batch
from sbs_sim.analysis.monte_carlo import gust_cases
from sbs_sim.cockpit.recorded_snapshots import RecordedSnapshots
from sbs_sim.config_file import config_folder
from sbs_sim.errors import SbsError
from sbs_sim.flight.gust_file import read_gust
from sbs_sim.flight.mixer import Mixer
from sbs_sim.flight.trim_point import TrimPoint
from sbs_sim.model.airfoil import read_table
from sbs_sim.model.gust_table import GustTable
from sbs_sim.model.wind import CHOICES, Wind
from sbs_sim.pilot.augmentation import StickPilot, augmentation
from sbs_sim.pilot.hover_hold import LIMITS, HoverHold, HoverModel, design
from sbs_sim.pilot.joystick import Joystick, JoystickFile
from sbs_sim.pilot.piloted_flight import simulate_with_pilot
from sbs_sim.recording import Log, LogWriter, qos_profiles, read, recover
from sbs_sim.recording.plot import plot
from sbs_sim.recording.recorded_flight import flight_of
from sbs_sim.recording.verification import verify

BAG = Path(__file__).resolve().parents[2] / "bags" / "hover_step.mcap"
COMMANDS = ("trim", "linearize", "sweep", "batch", "gusts", "plot")


@dataclass(frozen=True)
class FuzzTarget:
    """An entry point of the library that takes input from outside.

    Attributes
    ----------
    name : str
    inputs : SearchStrategy
    check : callable
        Takes an input; raises unless it is taken or refused in good order.
    share : float
        Of all inputs of a run, relative to the other targets: what is slow gets less.
    """

    name: str
    inputs: Any
    check: Callable[[Any], None]
    share: float = 1.0


# --- invalid input ---------------------------------------------------------------------------------------------------

EXTREMES = (
    0.0,
    -0.0,
    5e-324,
    1e-300,
    1e-9,
    1.0,
    -1.0,
    3.2,
    99.9,
    -1e2,
    1e9,
    1e300,
    -1e308,
    math.inf,
    -math.inf,
    math.nan,
)
NUMBERS = st.sampled_from(EXTREMES) | st.floats() | st.floats(-20.0, 20.0)
TEXTS = st.sampled_from(["", "no", "15", "sbs", "nan", "../x", "\0", "\x1b[2J", "a\nb", "ж" * 300]) | st.text(
    max_size=20
)
SCALARS = (
    st.none()
    | st.booleans()
    | st.integers()
    | st.sampled_from([400, 5000]).map(lambda digits: 10**digits)
    | NUMBERS
    | TEXTS
    | st.binary(max_size=8)
)
ANYTHING = st.recursive(
    SCALARS, lambda inner: st.lists(inner, max_size=4) | st.dictionaries(TEXTS, inner, max_size=3), max_leaves=8
) | st.sampled_from([object(), Wind, np.zeros((2, 2)), np.array(["a"]), np.float32(3), np.bool_(True), 1j, np.inf * 1j])


def mostly(good: Any, bad: Any = ANYTHING) -> Any:
    """Something right in most cases, so that the others are reached."""
    return st.integers(0, 5).flatmap(lambda k: bad if k == 0 else st.just(good))


def _is_long(value: Any) -> bool:
    """True for what may be right and takes minutes."""
    try:
        return bool(0.1 < value < 1e7)
    except Exception:
        return False


SHORT = ANYTHING.filter(lambda value: not _is_long(value))


@contextlib.contextmanager
def refusing() -> Iterator[None]:
    """Take a refusal in good order: an error of the package that is one line."""
    try:
        yield
    except SbsError as error:
        text = str(error)
        assert text, "a refusal without a word"
        assert len(text.splitlines()) == 1, f"a refusal of several lines: {text!r}"


# --- nothing is written elsewhere -------------------------------------------------------------------------------

_watch = threading.local()
_WRITES = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC


def _audit(event: str, arguments: tuple[Any, ...]) -> None:
    folder = getattr(_watch, "folder", None)
    if folder is None:
        return
    if event == "open" and isinstance(arguments[2], int) and arguments[2] & _WRITES:
        target = arguments[0]
    elif event in (
        "os.mkdir",
        "os.remove",
        "os.rename",
        "os.link",
        "os.symlink",
        "os.truncate",
        "os.rmdir",
        "os.chmod",
    ):
        target = arguments[1] if event in ("os.rename", "os.link", "os.symlink") else arguments[0]
    elif event in ("os.system", "subprocess.Popen", "os.exec", "os.posix_spawn", "socket.bind", "socket.connect"):
        raise AssertionError(f"{event} {arguments}")
    else:
        return
    if (
        isinstance(target, str | bytes | os.PathLike)
        and not os.fsdecode(target).startswith("/dev/")
        and not os.path.isdir(target)
    ):
        place = Path(os.path.abspath(os.fsdecode(target))).parent.resolve()  # what is made, and not where it points to
        assert place == folder or folder in place.parents, f"{event} outside of the folder: {target!r}"


sys.addaudithook(_audit)


@contextlib.contextmanager
def inside(folder: Path) -> Iterator[None]:
    """Fail on whatever this thread writes outside of a folder, and on processes and sockets."""
    _watch.folder = folder.resolve()
    try:
        yield
    finally:
        _watch.folder = None


@contextlib.contextmanager
def scratch() -> Iterator[Path]:
    """A folder that is the current one, outside of which nothing may be written."""
    before = Path.cwd()
    with tempfile.TemporaryDirectory(prefix="targets-") as name:
        (Path(name) / "inside").mkdir()
        folder = Path(name) / "inside"
        os.chdir(folder)
        try:
            with mock.patch.object(tempfile, "tempdir", str(folder)), inside(folder):
                yield folder
        finally:
            os.chdir(before)
        assert os.listdir(name) == ["inside"], "something was written beside the folder"


# --- Python API -------------------------------------------------------------------------------------------------

SBS = Aircraft.load("sbs")
HOVER = trim(SBS)
SPEEDS = mostly(0.0, st.floats(-8.0, 8.0) | ANYTHING)
CONDITIONS = {
    "airspeed": SPEEDS,
    "climb_rate": mostly(0.0),
    "sideslip": mostly(0.0),
    "turn_rate": mostly(0.0),
    "lead_lag": mostly(True),
    "cyclic_inflow": mostly(True),
    "azimuth_count": mostly(4),
}


def check_trim(given: dict[str, Any]) -> None:
    """Trim, linearize or sweep with anything for any argument."""
    given = dict(given)
    call, aircraft = given.pop("call"), given.pop("aircraft")
    with refusing():
        if call == "sweep":
            given.pop("method", None)
            found = sweep(aircraft, given.pop("parameter"), given.pop("values"), **given, workers=1)
            assert all(point.error or np.isfinite(point.trim.state).all() for point in found.points)
            return
        given = {name: value for name, value in given.items() if name not in ("parameter", "values", "linear")}
        if call == "trim":
            point = trim(aircraft, **given)
        else:
            model = linearize(aircraft, **given)
            assert np.isfinite(model.a).all()
            assert np.isfinite(model.b).all()
            point = model.trim
        assert isinstance(point, TrimPoint)
        assert np.isfinite(point.state).all()
        assert point.residual < 1e-6


TRIMS = st.fixed_dictionaries(
    {
        "call": st.sampled_from(["trim", "trim", "trim", "linearize", "sweep"]),
        "aircraft": mostly(SBS),
        "parameter": mostly("airspeed", st.sampled_from(["body.mass", "rotors.radius"]) | ANYTHING),
        "values": mostly([0.0], st.lists(NUMBERS, max_size=2) | ANYTHING),
        "linear": mostly(False),
        **CONDITIONS,
    },
    optional={"method": mostly("newton")},
)


def check_simulation(given: dict[str, Any]) -> None:
    """A simulation, or a flight of two ticks, with anything for any argument; states stay finite."""
    given = dict(given)
    call, aircraft, start, controls = (given.pop(name) for name in ("call", "aircraft", "start", "controls"))
    with refusing():
        if call == "simulate":
            flight = simulate(aircraft, start, controls, given.pop("duration"), **given)
            assert np.isfinite(flight["state"]).all()
            return
        simulation = Simulation(aircraft, start, controls, **{k: v for k, v in given.items() if k != "duration"})
        simulation.advance()
        assert np.isfinite(simulation.state).all()


STATES = st.lists(NUMBERS, min_size=43, max_size=43) | st.builds(
    lambda place, value: [*START[:place], value, *START[place + 1 :]], st.integers(0, 42), NUMBERS
)
START = Simulation(SBS, SBS.layout.from_linear(HOVER.state, 0.0), HOVER.swashplate).state.tolist()
SIMULATIONS = st.fixed_dictionaries(
    {
        "call": st.sampled_from(["simulate", "Simulation"]),
        "aircraft": mostly(SBS),
        "start": st.just(HOVER) | st.just(START) | STATES | ANYTHING,
        "controls": st.just(HOVER.controls)
        | st.just(HOVER.swashplate)
        | st.lists(NUMBERS, min_size=4, max_size=4)
        | ANYTHING,
        "duration": mostly(0.02, st.floats(max_value=0.1) | SHORT),
    },
    optional={
        "tick": mostly(0.01),
        "azimuth_step": mostly(0.08),
        "lead_lag": mostly(True),
        "cyclic_inflow": mostly(True),
        "method": mostly("rk4"),
        "wind": st.just(Wind()) | ANYTHING,
    },
)


def check_wind(given: dict[str, Any]) -> None:
    """A wind of anything; what is taken blows finitely."""
    with refusing():
        simulation = Simulation(SBS, START, HOVER.swashplate, wind=Wind(**given))
        for _ in range(2):
            assert np.isfinite(simulation.snapshot().wind).all()
            with contextlib.suppress(SbsError):
                simulation.advance()
            assert np.isfinite(simulation.state).all()


LOCAL_NUMBERS = (
    *("turbulence_lateral_length", "turbulence_vertical_length", "turbulence_span", "gust_length", "gust_direction"),
    *("gust_distance", "reference_height", "roughness_length", "profile_exponent"),
)
TRIPLES = st.tuples(NUMBERS, NUMBERS, NUMBERS) | st.just((1.0, 2.0, -1.0)) | ANYTHING
WINDS = st.fixed_dictionaries(
    {},
    optional={
        **dict.fromkeys(("velocity", "gust", "turbulence_intensity"), TRIPLES),
        **dict.fromkeys(
            ("gust_delay", "gust_duration", "turbulence_length", "turbulence_airspeed"), NUMBERS | ANYTHING
        ),
        "turbulence_direction": NUMBERS | ANYTHING,
        "turbulence_seed": st.integers() | ANYTHING,
        **{name: st.sampled_from(words) | ANYTHING for name, words in CHOICES.items()},
        **dict.fromkeys(LOCAL_NUMBERS, NUMBERS | st.floats(0.1, 10.0) | ANYTHING),
        "gust_origin": TRIPLES,
        "own_gust": st.just(GustTable("distance", [0.0, 2.0], [[0.0, 1.0, 0.0], [2.0, 0.0, -1.0]])) | ANYTHING,
    },
)
GUST_TEXTS = (
    b"time [s],north [m/s],east [m/s],down [m/s]\n0,0,0,0\n1,1,-2,3\n",
    b"distance [m],north [m/s],east [m/s],down [m/s]\n-2,0,0,0\n\n1.5,1,-2,3\n7,0,0,0\n",
)


def check_gust_file(data: bytes) -> None:
    """A table of an own gust; what is read blows finitely, at every time or distance."""
    with scratch() as folder:
        (folder / "gust.csv").write_bytes(data)
        with refusing():
            table = read_gust(folder / "gust.csv")
            assert np.isfinite(table.at(np.array([-1e9, 0.0, 0.5, 1e9]))).all()
            check_wind({"own_gust": table, "turbulence_extent": "elements"})


def check_mixer(moves: list[tuple[Any, Any]]) -> None:
    """A mixer with any controls at any times; its angles stay within their ranges."""
    mixer = Mixer(SBS)
    for controls, time in moves:
        with refusing():
            mixer.set_target(controls)
        with refusing():
            angles = mixer.move(time)
            Simulation.checked_swashplate(_SIMULATION, angles)


_SIMULATION = Simulation(SBS, START, HOVER.swashplate)
CONTROLS = st.lists(NUMBERS | st.floats(-2, 2), min_size=4, max_size=4)
MOVES = st.lists(st.tuples(CONTROLS | ANYTHING, st.floats(allow_nan=False, allow_infinity=False)), max_size=6)


def check_value(given: tuple[Any, Any]) -> None:
    """A value of the aircraft at any path."""
    path, value = given
    with refusing():
        changed = SBS.with_value(path, value)
        assert is_finite_model(changed)
    with refusing():
        SBS.value(path)


def _paths(node: Any, path: str = "") -> Iterator[str]:
    if isinstance(node, dict):
        for key, value in node.items():
            yield from _paths(value, f"{path}.{key}".lstrip("."))
    elif isinstance(node, list):
        for i, value in enumerate(node):
            yield from _paths(value, f"{path}[{i}]")
    if path:
        yield path


PATHS = st.sampled_from([*_paths(SBS.data), "rotors.radius", "rotors.MR1.hub"])
VALUES = st.tuples(PATHS | PATHS.map(lambda path: path[:-1]) | ANYTHING, ANYTHING)


def check_export(given: tuple[LinearModel, Any]) -> None:
    """A linear model into a file of any name; whole, or not at all."""
    model, path = given
    with scratch() as folder:
        with refusing():
            model.save(path)
            assert (folder / path).stat().st_size > 1000
        assert not [name for name in os.listdir(folder) if name.startswith(".")], "something was left beside the file"


EXPORTS = st.deferred(
    lambda: st.tuples(st.just(HOVER_MODEL), st.sampled_from(["a.npz", "a.mat", "b.JSON"]) | TARGETS | ANYTHING)
)


def check_batch(given: dict[str, Any]) -> None:
    """Many flights with anything for any argument; a flight that fails says why and disturbs no other."""
    with refusing():
        batch = simulate_batch(given["cases"], given["duration"], **given["options"])
        assert len(batch.errors) == len(given["cases"])
        assert all(error is None or len(error.splitlines()) == 1 for error in batch.errors)
        for values in batch.histories.values():
            assert not np.isinf(values).any()
            whole = [i for i, error in enumerate(batch.errors) if error is None]
            assert np.isfinite(values[whole]).all()


# Of nobody, and on this machine: nothing here may look up names elsewhere.
ADDRESSES = st.sampled_from(["", "x", "tcp://127.0.0.1:1", "127.0.0.1", "tcp://127.0.0.1:99999", "a\0b", "http://", 5])


CASES = st.builds(
    lambda given: Case(**given),
    st.fixed_dictionaries(
        {
            "aircraft": mostly(SBS),
            "start": st.just(HOVER) | st.sampled_from([{"airspeed": 3.0}, {"speed": 3.0}, {}]) | STATES | ANYTHING,
        },
        optional={
            "controls": mostly(HOVER.controls, st.lists(NUMBERS, min_size=4, max_size=4) | ANYTHING),
            "wind": mostly(Wind()),
            "changes": mostly({}, st.dictionaries(PATHS, SCALARS, max_size=2) | ANYTHING),
        },
    ),
)
BATCHES = st.fixed_dictionaries(
    {
        "cases": st.lists(CASES, max_size=3) | mostly([Case(SBS, HOVER)]),
        "duration": mostly(0.02, st.floats(max_value=0.1) | SHORT),
        "options": st.fixed_dictionaries(
            {},
            optional={
                "every": mostly(1),
                "outputs": mostly(("state", "power"), st.lists(TEXTS, max_size=2) | ANYTHING),
                "tick": mostly(0.01, SHORT),
                "azimuth_step": mostly(0.08),
                "lead_lag": mostly(True),
                "method": mostly("rk4"),
                "workers": mostly(2),
                "memory": mostly(1e9),
                "dask": st.none() | ADDRESSES,
                "unknown": ANYTHING,
            },
        ),
    }
)


def check_gust_cases(given: dict[str, Any]) -> None:
    """Flights through turbulence, as the command `batch` plans them."""
    given = dict(given)
    with refusing():
        cases = gust_cases(given.pop("aircraft"), given.pop("flights"), given.pop("condition"), **given)
        assert all(math.isfinite(value) for case in cases for value in case.changes.values())


GUST_CASES = st.fixed_dictionaries(
    {
        "aircraft": mostly(SBS),
        "flights": mostly(2, st.sampled_from([0, -1, 3, 10**9]) | SHORT),
        "condition": mostly({}, st.dictionaries(st.just("airspeed"), NUMBERS | ANYTHING, max_size=1) | ANYTHING),
        "turbulence": mostly(1.5, NUMBERS | ANYTHING),
    },
    optional={
        "length": NUMBERS | ANYTHING,
        "seed": st.integers() | ANYTHING,
        "spread": st.dictionaries(PATHS | TEXTS, st.just(0.05) | SCALARS, max_size=2) | ANYTHING,
    },
)


# --- pilots -----------------------------------------------------------------------------------------------------

HOVER_MODEL = linearize(SBS, azimuth_count=4)
DESIGN = design(HoverModel.of(HOVER_MODEL))
STICKS = augmentation(HOVER_MODEL)


def check_pilot(given: dict[str, Any]) -> None:
    """Hover hold and sticks: any limits, targets, times and states; the controls are finite, or refused."""
    with refusing():
        assert design(HoverModel.of(HOVER_MODEL), given["limits"]).is_stable
    pilots = HoverHold(DESIGN), StickPilot(STICKS, [0.05] * 4)
    for time, body, position, heading in given["moves"]:
        with refusing():
            pilots[0].hold(position, heading)
        for pilot in pilots:
            with refusing():
                assert np.isfinite(pilot.controls(time, body)).all()
            assert np.isfinite(pilot.controls(1.0, START)).all(), "what was refused has changed something"


BODIES = STATES | st.lists(NUMBERS, min_size=13, max_size=13) | ANYTHING
PILOTS = st.fixed_dictionaries(
    {
        "limits": mostly(None, st.dictionaries(st.sampled_from([*LIMITS, "x"]), SCALARS, max_size=2) | ANYTHING),
        "moves": st.lists(
            st.tuples(
                NUMBERS | ANYTHING, BODIES, st.lists(NUMBERS, min_size=3, max_size=3) | ANYTHING, NUMBERS | ANYTHING
            ),
            max_size=3,
        ),
    }
)


def check_pilot_flight(given: dict[str, Any]) -> None:
    """A flight with a pilot who gives anything."""
    answers = iter(given["answers"])
    with refusing():
        flight = simulate_with_pilot(
            given["aircraft"],
            given["start"],
            lambda time, state: next(answers, HOVER.controls),
            given["duration"],
            **given["options"],
        )
        assert np.isfinite(flight["controls"]).all()


PILOT_FLIGHTS = st.fixed_dictionaries(
    {
        "aircraft": mostly(SBS),
        "start": st.just(HOVER) | st.just(START) | STATES | ANYTHING,
        "answers": st.lists(st.just(HOVER.controls) | CONTROLS | ANYTHING, max_size=3),
        "duration": mostly(0.02, st.floats(max_value=0.1) | SHORT),
        "options": st.fixed_dictionaries({}, optional={"wind": mostly(Wind()), "delay": mostly(1), "tick": SHORT}),
    }
)


def check_joystick(given: dict[str, Any]) -> None:
    """A joystick file, and messages of any axes and buttons; what is read is finite."""
    with scratch() as folder:
        (folder / "a.yaml").write_bytes(given["file"])
        with refusing():
            joystick = Joystick(JoystickFile.load(str(folder / "a.yaml"), given["pad"]))
            for axes, buttons in given["messages"]:
                with refusing():
                    reading = joystick.read(axes, buttons)
                    assert np.abs(reading.sticks).max() <= 1.0
                    assert np.abs(reading.trim).max() <= 1.0


JOYSTICK = (config_folder() / "joystick.yaml").read_bytes()
JOYSTICKS = st.deferred(
    lambda: st.fixed_dictionaries(
        {
            "file": st.just(JOYSTICK) | mutated([JOYSTICK], PIECES),
            "pad": mostly("xbox", st.sampled_from(["gamepad", "transmitter"]) | TEXTS),
            "messages": st.lists(
                st.tuples(st.lists(NUMBERS, max_size=8), st.lists(st.integers(-1, 2), max_size=12)), max_size=3
            ),
        }
    )
)


# --- files ------------------------------------------------------------------------------------------------------

PIECES = (
    b"!!python/name:os.system ",
    b"&a [*a]",
    b"*a",
    b"<<: *r",
    b".inf",
    b".nan",
    b"1e999",
    b"- ",
    b"{",
    b"[",
    b"\t",
    b'"',
)
PIECES += (
    b"\xff\xfe",
    b"\0",
    b"9" * 5000,
    b"\n",
    b": ",
    b"#",
    b"---\n",
    b"!!set {a}",
    b"2020-01-01",
    b"~",
    b"-",
    b"0x1F",
    b"1_0",
)
YAML_TEXTS = [path.read_bytes() for path in sorted((config_folder() / "aircraft").glob("*.yaml"))]
AIRFOIL = (config_folder() / "airfoils" / "linear_573.csv").read_bytes()


def mutated(originals: list[bytes], pieces: tuple[bytes, ...] = (), most: int = 4) -> Any:
    """A file with some bytes of it taken out, put in, doubled or overwritten."""

    def change(seed: int, count: int) -> bytes:
        chance = random.Random(seed)
        data = chance.choice(originals)
        for _ in range(count):
            place, length = chance.randrange(len(data) + 1), chance.choice((0, 0, 1, 2, 8, 40, 300))
            insert = chance.choice(
                (b"", chance.randbytes(chance.choice((1, 2, 8, 50))), data[place : place + 30], *pieces)
            )
            data = data[:place] + insert + data[place + length :]
        return data

    return st.builds(change, st.integers(0, 2**32), st.integers(0, most))


def check_yaml(data: bytes) -> None:
    """An aircraft file; what loads has a finite model and keeps its name to itself."""
    with scratch() as folder:
        (folder / "a.yaml").write_bytes(data)
        with refusing():
            loaded = Aircraft.load(folder / "a.yaml")
            assert is_finite_model(loaded)
            assert np.isfinite(loaded.value("body.mass"))


def check_yaml_values(changes: list[tuple[str, Any]]) -> None:
    """An aircraft file with other values in its places."""
    if not isinstance(changes, list):
        changes = [changes]
    data: Any = YAML(typ="safe", pure=True).load(YAML_TEXTS[0])
    for path, value in changes:
        node, steps = data, path.replace("[", ".[").split(".")
        try:
            for step in steps[:-1]:
                node = node[int(step[1:-1]) if step.startswith("[") else step]
            node[int(steps[-1][1:-1]) if steps[-1].startswith("[") else steps[-1]] = value
        except (KeyError, IndexError, TypeError):
            continue
    with refusing():
        loaded = Aircraft.from_dict(data)
        assert is_finite_model(loaded)


def check_airfoil(data: bytes) -> None:
    """An airfoil table; what is read is finite."""
    with scratch() as folder:
        (folder / "a.csv").write_bytes(data)
        with refusing():
            table = read_table(folder / "a.csv", 8.0)
            assert all(np.isfinite(values).all() for values in (table.numbers, table.alpha, table.cl, table.cd))
            assert (table.cd > 0).all()
        with refusing():
            extension = (*METHODS, None)[len(data) % (len(METHODS) + 1)]
            table, _ = table_of("a", read_airfoil(folder / "a.csv").polars, extension, 8.0)
            assert all(np.isfinite(values).all() for values in (table.numbers, table.alpha, table.cl, table.cd))
            assert (table.cd > 0).all()
            c81_text(table, "a")


CSV_PIECES = (
    b"nan",
    b"inf",
    b"1e308",
    b"-1e308",
    b"1e-320",
    b",",
    b"\n",
    b"0,0,0,0\n",
    b"#",
    b"\0",
    b"\xff",
    b"1_0",
    b" ",
    b"5e5",
)


def _small_airfoil() -> bytes:
    rows = ["reynolds,alpha_deg,cl,cd"]
    rows += [
        f"{re},{angle},{0.1 * angle},{0.01 + 1e-4 * angle * angle}" for re in (1e5, 1e6) for angle in range(-10, 11, 5)
    ]
    return "\n".join(rows).encode()


AIRFOILS = (
    _small_airfoil(),
    b"""C81                            2 4 2 3 0 0
           0.0    0.5
-180.00 0.0000 0.0000
   0.00 0.1000 0.2000
  10.00 1.0000 1.1000
 180.00 0.0000 0.0000
           0.0    0.9
-180.00 0.0200 0.0200
   0.00 0.0100 0.0200
 180.00 0.0200 0.0200
""",
    b""" Calculated polar for: W
 1 1 Reynolds number fixed          Mach number fixed
 Mach =   0.000     Re =     0.500 e 6     Ncrit =   9.000
   alpha    CL        CD       CDp       CM
  ------ -------- --------- --------- --------
  -5.000  -0.4442   0.00802   0.00175  -0.0533
   0.000   0.0442   0.00702   0.00175  -0.0533
   5.000   0.5697   0.00842   0.00220  -0.0526
""",
    b"""0.75 Re
5 NumAlf
-180 0 0.02
-7.62 -0.5 0.01
0 0.1 0.01
7.11 0.6 0.01
180 0 0.02
""",
    b"""of a test
1 Number of airfoil tables in this file
0 Table ID parameter
-180 0 0.02
-7.6 -0.5 0.01
0 0.1 0.01
7.1 0.6 0.01
180 0 0.02
EOT
""",
    b"""Xfoil polar. Reynolds number fixed. Mach  number fixed
Airfoil,n12
Reynolds number,50000
Mach,0
Alpha,Cl,Cd,Cdp
-9.25,-0.9,0.02,0.01
0,0.1,0.01,0.01
9.25,1.0,0.02,0.01
""",
)


def _small_log() -> bytes:
    """Half a second of the recorded flight: what is damaged should not be a megabyte each time."""
    from mcap.reader import make_reader

    with BAG.open("rb") as file, tempfile.TemporaryDirectory() as folder:
        reader, path = make_reader(file), Path(folder) / "small.mcap"
        metadata = {record.name: dict(record.metadata) for record in reader.iter_metadata()}
        kept = {name: _unsigned(metadata[name]) for name in ("simulation", "versions")}
        attachments = {item.name: item.data for item in reader.iter_attachments()}
        with LogWriter(path, library="targets", wall_start=0, metadata=kept, attachments=attachments) as log:
            numbers: dict[str, int] = {}
            for schema, channel, message in reader.iter_messages(ending_before=100_000_000):
                if channel.topic not in numbers:
                    numbers[channel.topic] = log.add_channel(
                        channel.topic, schema.name, schema.data.decode(), qos_profiles()
                    )
                log.write(numbers[channel.topic], message.log_time, message.data)
        return path.read_bytes()


def _unsigned(metadata: dict[str, str]) -> dict[str, str]:
    return {key: value for key, value in metadata.items() if key not in ("crc32", "recording_id")}


SMALL_LOG = _small_log()


def check_log(data: bytes) -> None:
    """A log: read, recovered, drawn and flown again, as far as it goes."""
    with scratch() as folder:
        path = folder / "a.mcap"
        path.write_bytes(data)
        use_log(path, zlib.crc32(data) % 20 == 0)
        check_recovery(path)


def check_reading(data: bytes) -> None:
    """A log that is read and recovered only, which is quick."""
    with scratch() as folder:
        path = folder / "a.mcap"
        path.write_bytes(data)
        with refusing():
            check_topics(read(path))
        check_recovery(path)


def check_recovery(path: Path) -> None:
    """What is recovered is whole."""
    whole = path.with_suffix(".whole.mcap")
    with refusing():
        recover(path, whole)
        assert read(whole).complete


def check_topics(log: Log) -> None:
    """Every field of every topic is read, or refused."""
    for topic in log.values():
        with refusing():
            assert all(len(values) == len(topic.time) for values in topic.values())
            assert len(topic.units) == len(topic)


def use_log(path: Path, draw: bool) -> None:
    """All that is done with a log; drawing takes most of the time."""
    with refusing():
        log = read(path)
        check_topics(log)
        with refusing():
            assert log.wall_start_ns is None or log.wall_start_ns >= 0
        with refusing():
            if draw:
                plot(log, path.with_suffix(".svg"))
        with refusing():
            verify(flight_of(log))
    with refusing():
        recording = RecordedSnapshots(path)  # as the cockpit shows it
        for time in (-1.0, recording.beginning, 0.5 * recording.end, 1e9):
            snapshot = recording.at(time)
            assert snapshot.loads.shape[0] == len(recording.aircraft.rotors)


def check_foreign(given: dict[str, Any]) -> None:
    """A whole log, every checksum right, whose contents are invalid."""
    with scratch() as folder:
        path = folder / "foreign.mcap"
        with contextlib.suppress(SbsError), _writer(path, given) as log:
            for i, (topic, kind, text, messages) in enumerate(given["topics"]):
                with contextlib.suppress(SbsError):
                    channel = log.add_channel(topic, kind, text, qos_profiles())
                    for time, message in messages:
                        log.write(channel, time, message)
                assert i < 100
        if path.exists():
            use_log(path, given["draw"])


def _writer(path: Path, given: dict[str, Any]) -> LogWriter:
    return LogWriter(
        path, library="targets", wall_start=0, metadata=given["metadata"], attachments=given["attachments"]
    )


def _real_log() -> tuple[dict[str, Any], dict[str, Any], dict[str, Any]]:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "small.mcap"
        path.write_bytes(SMALL_LOG)
        log = read(path)
        real = {
            name: _unsigned(dict(data)) for name, data in log.metadata.items() if name in ("simulation", "versions")
        }
        topics = {}
        for name in log.topics:
            topic = log[name]
            topics[name] = (
                topic.type,
                topic._schema.data.decode(),
                list(zip(topic.time_ns.tolist(), topic._messages, strict=True)),
            )
        return real, dict(log.attachments), topics


REAL_METADATA, REAL_FILES, REAL_TOPICS = _real_log()
CDR_NUMBERS = st.sampled_from(
    [b"\xff" * 4, b"\xff" * 8, b"\0" * 8, np.float64(np.nan).tobytes(), np.float64(1e300).tobytes()]
)


@st.composite
def foreign_logs(draw: Any) -> dict[str, Any]:
    """The recorded flight with something else in some of its places."""
    metadata = {name: dict(data) for name, data in REAL_METADATA.items()}
    for name, data in metadata.items():
        for key in draw(st.lists(st.sampled_from(sorted(data)), max_size=1)):
            metadata[name][key] = draw(st.sampled_from(["", "nan", "-1", "1e400", "0", "True", "x", "1e-300"]))
    files = {name: content for name, content in REAL_FILES.items() if draw(st.integers(0, 9))}
    for _ in range(draw(st.integers(0, 2))):
        name = draw(
            st.sampled_from(
                [
                    "aircraft.yaml",
                    "airfoils/..",
                    "airfoils/../../x.csv",
                    "airfoils/",
                    "airfoils/" + "x" * 300,
                    "airfoils/a\0b",
                    "airfoils/aircraft.yaml",
                    "/etc/x",
                    "airfoils/0_naca0012.csv",
                ]
            )
        )
        files[name] = draw(st.sampled_from([b"", b"x", *YAML_TEXTS]) | mutated(YAML_TEXTS, PIECES))
    topics = []
    for name, (kind, text, messages) in REAL_TOPICS.items():
        if not draw(st.integers(0, 12)):
            continue
        change = draw(st.integers(0, 8))
        if change == 0:
            messages = [(time, _damaged(draw, data)) for time, data in messages]
        elif change == 1:
            messages = [(draw(st.sampled_from([0, 1, 2**62, time])), data) for time, data in messages]
        elif change == 2:
            text = draw(st.sampled_from(["", "float64 x\n", text[: len(text) // 2], text.replace("float64", "uint8")]))
        elif change == 3:
            messages = []
        topics.append((name, kind, text, messages))
    return {"metadata": metadata, "attachments": files, "topics": topics, "draw": draw(st.integers(0, 4)) == 0}


def _damaged(draw: Any, data: bytes) -> bytes:
    place = draw(st.integers(4, max(4, len(data))))
    new = draw(CDR_NUMBERS)
    return data[:place] + new + data[place + len(new) :]


# --- commands ---------------------------------------------------------------------------------------------------

ANGLES = ("200", "-1e1", "3", "-inf")
WORDS = st.sampled_from(
    ["", "0", "-1e1", "1e400", "nan", "-inf", "15", "5", "x", "--", "-", "-h", "é", "\x1b", "1" * 400, "body.mass=25"]
)
TARGETS = st.sampled_from(
    [
        "out.json",
        "out.npz",
        "sub/out.json",
        "..",
        ".",
        "",
        "/dev/full",
        "x" * 300 + ".json",
        "a\0b.json",
    ]
)
OPTIONS = {
    "trim": {
        **dict.fromkeys(
            ("--airspeed", "--climb-rate", "--sideslip-deg", "--turn-rate-deg"),
            st.sampled_from(["0", "2", *ANGLES]) | WORDS,
        ),
        "--aircraft": st.sampled_from(["sbs", "sbs_paper", "", ".", "/dev/zero", "..", "nothing", "/"]) | WORDS,
        "--set": st.sampled_from(
            [
                "body.mass=22",
                "rotors.radius=-1",
                "body.mass=[[",
                "=",
                "a=b=c",
                "name=../../x",
                "rotors=[]",
                "body.mass=" + "[" * 5000,
                "rotors.MR1.hub[0]=1e999",
                "body.mass=" + "9" * 5000,
            ]
        )
        | WORDS,
        "--azimuth-count": st.sampled_from(["2", "0", "-4", "1e3", "99999999999999999999"]),
        "--method": st.sampled_from(["newton", "two_loop", "averaged", "paper", ""]),
        "--json": TARGETS,
        "--no-lead-lag": None,
        "--no-cyclic-inflow": None,
    },
    "plot": {"--out": TARGETS | st.sampled_from(["a.svg", "a.html", "a.pdf"])},
}
OPTIONS["linearize"] = {
    **OPTIONS["trim"],
    **dict.fromkeys(("--out", "--export"), TARGETS),
    "--matrices": None,
    "--quasi-static": None,
    "--derivatives": None,
    "--participation": None,
}
OPTIONS["sweep"] = {
    **OPTIONS["trim"],
    "--trims-only": None,
    "--workers": st.sampled_from(["1", "0", "-1", "x", "99999"]),
    "--csv": TARGETS,
    "--values": WORDS,
}
AIR_OPTIONS = {
    "--extent": st.sampled_from(["point", "rates", "field", "elements", "both", ""]),
    "--spectrum": st.sampled_from(["dryden", "von_karman", "karman"]),
    "--severity": st.sampled_from(["light", "severe", "none"]),
    "--height": st.sampled_from(["30", "-1e9", "1e9", "nan", "x"]),
    "--gust-file": st.sampled_from(["a.csv", "nothing.csv", ".", "/dev/zero", ""]),
}
OPTIONS["batch"] = {
    **OPTIONS["trim"],
    "--flights": st.sampled_from(["1", "2", "0", "-1", "x", "99999999999"]),
    "--duration": st.sampled_from(["0.05", "0", "-1", "nan", "1e9"]) | WORDS.filter(lambda text: text != "15"),
    **dict.fromkeys(("--turbulence", "--length", "--seed"), st.sampled_from(["0", "1", "-1", "1e9"]) | WORDS),
    **AIR_OPTIONS,
    "--spread": st.sampled_from(["body.mass=0.05", "body.mass=2", "name=0.1", "rotors=0.1", "x"]) | WORDS,
    "--every": st.sampled_from(["0.1", "0", "1e9", "nan"]) | WORDS,
    "--workers": OPTIONS["sweep"]["--workers"],
    "--dask": ADDRESSES.map(str),
    "--csv": TARGETS,
}
OPTIONS["gusts"] = {
    "--aircraft": OPTIONS["trim"]["--aircraft"],
    "--set": OPTIONS["trim"]["--set"],
    **dict.fromkeys(
        ("--wind", "--turbulence", "--length", "--gust", "--gust-duration"),
        st.sampled_from(["0", "101", "-1e9"]) | WORDS,
    ),
    **AIR_OPTIONS,
    "--rule": st.sampled_from(["cs25", "cs27", "cs99", ""]),
    "--gradient": st.sampled_from(["20", "0", "-1", "nan", "1e9"]),
    "--seed": st.sampled_from(["0", "-1", "1e9", "99999999999999999999"]) | WORDS,
    "--duration": st.sampled_from(["1", "0", "1e9", "nan"]),
    "--delay": st.sampled_from(["1", "-1", "101", "x"]),
    "--limit": st.sampled_from(
        ["forward=0.3", "forward=0", "forward=1e-300", "heading=1e300", "x=1", "u", "=", "u=nan"]
    ),
    "--json": TARGETS,
}
SHORT_BATCH = ["--flights", "2", "--duration", "0.05", "--azimuth-count", "2"]
POSITIONALS = {
    "batch": st.sampled_from([[], ["x"], ["--every", "0"], ["--spread", "name=1"]]).map(SHORT_BATCH.__add__),
    "gusts": st.sampled_from([["x"], ["--delay", "-1"], ["--limit", "forward=0"], ["--seed", "-1"]]),
    "trim": st.just([]) | st.lists(WORDS, max_size=1),
    "linearize": st.just([]) | st.lists(WORDS, max_size=1),
    "sweep": st.sampled_from(
        [
            ["airspeed", "0", "1e0", "2"],
            ["sideslip_deg", "-1e1", "400", "2"],
            ["body.mass", "20", "-1", "2"],
            ["x"],
            ["airspeed", "0", "1", "1e9"],
            ["airspeed", "nan", "1", "2"],
            ["turn-rate-deg", "0", "-5e0", "2"],
        ]
    ),
    "plot": st.sampled_from([["a.mcap"], ["nothing.mcap"], ["."], ["/dev/zero"], [""], ["a\0b"]]),
}


@st.composite
def command_lines(draw: Any) -> tuple[str, list[str]]:
    """A command with some of its options, right and wrong, in any order."""
    name = draw(st.sampled_from(COMMANDS))
    words = list(draw(POSITIONALS[name]))
    for option in draw(st.lists(st.sampled_from(sorted(OPTIONS[name])), max_size=3)):
        if name == "gusts" and option == words[0]:
            continue  # a right one would fly for seconds
        value = OPTIONS[name][option]
        words += [option] if value is None else [option, draw(value)]
    return name, words


def check_command(given: tuple[str, list[str]]) -> None:
    """A command line: exit code 0, 1 with one line on stderr, or 2 with the usage; files in the folder only."""
    name, words = given
    code, out, err = call_command(name, words)
    assert code in (0, 1, 2), f"exit code {code}: {err}"
    assert "Traceback" not in out + err
    if code == 1:
        assert len(err.splitlines()) >= 1, "a failure without a word"
        assert len([line for line in err.splitlines() if "is not complete" not in line]) == 1, f"not one line: {err!r}"
    if code == 2:
        assert err.startswith(f"usage: {name}")


def call_command(name: str, words: list[str]) -> tuple[Any, str, str]:
    """Exit code and output of a command in this process."""
    module = __import__(f"sbs_sim.commands.{name}", fromlist=["main"])
    out, err = io.StringIO(), io.StringIO()

    def no_exit(code: int) -> None:
        raise AssertionError(f"os._exit({code}): {err.getvalue()}")

    with contextlib.ExitStack() as stack:
        folder = stack.enter_context(scratch())
        if name == "plot":
            (folder / "a.mcap").write_bytes(SMALL_LOG)
        stack.enter_context(mock.patch.object(sys, "argv", [name, *words]))
        stack.enter_context(mock.patch.object(os, "_exit", no_exit))
        stack.enter_context(mock.patch("signal.signal"))
        stack.enter_context(contextlib.redirect_stdout(out))
        stack.enter_context(contextlib.redirect_stderr(err))
        try:
            code = module.main()
        except SystemExit as end:
            code = end.code
        return (code or 0), out.getvalue(), err.getvalue()


FUZZ_TARGETS = (
    FuzzTarget("trim, linearize, sweep", TRIMS, check_trim, 3.0),
    FuzzTarget("Simulation, simulate", SIMULATIONS, check_simulation, 3.0),
    FuzzTarget("Wind", WINDS, check_wind, 2.0),
    FuzzTarget("own gust, CSV", mutated(GUST_TEXTS, CSV_PIECES), check_gust_file, 1.0),
    FuzzTarget("Mixer", MOVES, check_mixer, 2.0),
    FuzzTarget("with_value", VALUES, check_value, 2.0),
    FuzzTarget("simulate_batch", BATCHES, check_batch, 2.0),
    FuzzTarget("gust_cases", GUST_CASES, check_gust_cases, 1.0),
    FuzzTarget("LinearModel.save", EXPORTS, check_export, 1.0),
    FuzzTarget("hover hold, sticks", PILOTS, check_pilot, 0.5),
    FuzzTarget("pilot.piloted_flight.simulate_with_pilot", PILOT_FLIGHTS, check_pilot_flight, 1.0),
    FuzzTarget("joystick file, axes", JOYSTICKS, check_joystick, 2.0),
    FuzzTarget("aircraft file, bytes", mutated(YAML_TEXTS, PIECES), check_yaml, 2.0),
    FuzzTarget("aircraft file, values", st.lists(st.tuples(PATHS, ANYTHING), max_size=3), check_yaml_values, 2.0),
    FuzzTarget("airfoil file", mutated([AIRFOIL, *AIRFOILS], CSV_PIECES), check_airfoil, 2.0),
    FuzzTarget("log, bytes", mutated([SMALL_LOG]), check_log, 0.6),
    FuzzTarget("log, contents", foreign_logs(), check_foreign, 0.5),
    FuzzTarget("command lines", command_lines(), check_command, 2.0),
)
