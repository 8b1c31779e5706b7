"""Air that is not the same everywhere over ROS: set by a service, and repeated bit for bit from the log."""

import json
from dataclasses import replace

import numpy as np
import pytest
from helpers import aircraft_data

rclpy = pytest.importorskip("rclpy")

from geometry_msgs.msg import Vector3  # noqa: E402
from recorded_flights import assert_identical, fly, wiggle  # noqa: E402

from sbs_msgs.srv import SetWind  # noqa: E402
from sbs_sim import Aircraft, trim  # noqa: E402
from sbs_sim.flight.gust_standards import specified_turbulence  # noqa: E402
from sbs_sim.model.gust_table import GustTable  # noqa: E402
from sbs_sim.model.wind import Wind  # noqa: E402
from sbs_sim.recording import read  # noqa: E402
from sbs_sim.recording.recorded_flight import flight_of  # noqa: E402
from sbs_sim.recording.verification import verify  # noqa: E402

ONES = Vector3(x=1.0, y=1.0, z=0.5)
TABLE = "distance [m],north [m/s],east [m/s],down [m/s]\n0,0,0,0\n2.5,0,0,-1.5\n\n5,0.5,0,0\n"
REFUSED = {
    "own_gust_csv": (
        "time,north\n1,2",
        "own_gust_csv: the first line is 'time,north': allowed is 'time [s],north [m/s],east [m/s],down [m/s]' or",
    ),
    "turbulence_extent": ("planes", "turbulence_extent = 'planes': allowed are point, rates, field, elements"),
    "roughness_length": (-1.0, "roughness_length = -1.0: allowed are 0, which is 0.15 ft, and 1e-06 to 10 m"),
    "gust_length": (float("nan"), "gust_length = nan: allowed are 0, which is a gust over time, and 0.1 to 1e+06 m"),
}


def test_every_kind_of_air_comes_again_bit_for_bit(sbs, tmp_path):
    """A field, rates, a front, an own gust and a profile; what is refused changes nothing."""

    def act(made):
        def blow(**fields):
            answer = made.client.call(SetWind, "set_wind", **fields)
            assert answer.success, answer.message
            wiggle(made, trim(sbs), 0.15)

        blow(turbulence_intensity=ONES, turbulence_extent="field", turbulence_seed=2**63 + 1, velocity=Vector3(x=-3.0))
        blow(turbulence_intensity=ONES, turbulence_extent="rates", turbulence_model="von_karman")
        blow(gust=Vector3(z=-2.0), gust_length=2.0, gust_shape="ramp", velocity=Vector3(x=-4.0))
        for name, (value, line) in REFUSED.items():
            refused = made.client.call(SetWind, "set_wind", **{name: value})
            assert not refused.success
            assert refused.message.startswith(line)
        blow(own_gust_csv=TABLE, gust_distance=-1.0)
        blow(velocity=Vector3(y=2.0), wind_profile="power", profile_exponent=0.3)
        blow(turbulence_intensity=ONES, turbulence_extent="elements")

    log = fly(tmp_path, act)
    assert_identical(log)
    winds = [event.wind for event in flight_of(read(log)).events if event.kind == "wind"]
    assert [wind.turbulence_extent for wind in winds] == ["field", "rates", "point", "point", "point", "elements"]
    assert winds[0].turbulence_seed == 2**63 + 1
    assert winds[1].turbulence_span == sbs.rotor_span
    assert winds[1].turbulence_model == "von_karman"
    assert (winds[2].gust_shape, winds[2].gust_length) == ("ramp", 2.0)
    assert np.any(winds[2].gust_origin)
    expected = GustTable("distance", [0.0, 2.5, 5.0], [[0, 0, 0], [0, 0, -1.5], [0.5, 0, 0]])
    assert winds[3].own_gust == expected
    assert (winds[4].wind_profile, winds[4].profile_exponent, winds[4].own_gust) == ("power", 0.3, None)
    assert len({event.step for event in flight_of(read(log)).events if event.kind == "wind"}) == len(winds)


RING = {"descent": "measured", "induced_power_factor": 1.1, "ring_unsteadiness": 0.2}


def test_the_air_of_parameters_and_the_noise_of_vortex_rings_come_again(tmp_path):
    """The parameters make the wind that they name; in calm air the seed alone decides how the thrust fluctuates."""
    (tmp_path / "gust.csv").write_text(TABLE)
    path = tmp_path / "ring.yaml"
    path.write_text(json.dumps(aircraft_data(options={"elements": 3}, every_rotor=RING)))
    words = {"wind_profile": "power", "turbulence_model": "von_karman", "turbulence_extent": "field"}
    numbers = {"reference_height": 12.0, "roughness_length": 0.1, "profile_exponent": 0.3, "turbulence_seed": 9}
    sinking = trim(Aircraft.load(str(path)), climb_rate=-8.0)
    start = {"climb_rate": -8.0, "altitude": 500.0, "heading": 0.4, "ground_altitude": 100.0}

    def act(made):
        wiggle(made, sinking, 0.15)
        answer = made.client.call(SetWind, "set_wind", turbulence_seed=11)
        assert answer.success, answer.message
        wiggle(made, sinking, 0.3)

    log = fly(
        *(tmp_path, act),
        **(words | numbers | start),
        aircraft=path,
        wind=[-3.0, 1.0, 0.2],
        turbulence="light",
        gust_file=tmp_path / "gust.csv",
    )
    assert_identical(log)
    flight = flight_of(read(log))
    expected = Wind(
        velocity=(-3.0, 1.0, 0.2),
        gust_direction=0.4,
        own_gust=GustTable("distance", [0.0, 2.5, 5.0], [[0, 0, 0], [0, 0, -1.5], [0.5, 0, 0]]),
        **specified_turbulence(400.0, "light", model="von_karman"),
        turbulence_airspeed=float(np.hypot(3.0, 1.0)),
        turbulence_direction=0.4,
        **{name: value for name, value in (words | numbers).items() if name != "turbulence_model"},
    )
    assert flight.events[0].wind == expected
    (number,) = (i for i, event in enumerate(flight.events) if event.kind == "wind")
    calm = flight.events[number].wind
    assert not calm.is_local
    assert not any(calm.turbulence_intensity)
    assert calm.turbulence_seed == 11
    events = list(flight.events)
    events[number] = replace(events[number], wind=replace(calm, turbulence_seed=12))
    other = verify(replace(flight, events=tuple(events))).first
    assert other.step > events[number].step, "until then it is the same flight"
