"""Air that is not the same everywhere over ROS: set by a service, and repeated bit for bit from the log."""

import numpy as np
import pytest

rclpy = pytest.importorskip("rclpy")

from geometry_msgs.msg import Vector3  # noqa: E402
from recorded_flights import assert_identical, fly, wiggle  # noqa: E402

from sbs_msgs.srv import SetWind  # noqa: E402
from sbs_sim import trim  # noqa: E402
from sbs_sim.model.gust_table import GustTable  # noqa: E402
from sbs_sim.recording import read  # noqa: E402
from sbs_sim.recording.recorded_flight import flight_of  # noqa: E402

ONES = Vector3(x=1.0, y=1.0, z=0.5)
TABLE = "distance [m],north [m/s],east [m/s],down [m/s]\n0,0,0,0\n2.5,0,0,-1.5\n\n5,0.5,0,0\n"
REFUSED = {
    "own_gust_csv": (
        "time,north\n1,2",
        "own_gust_csv: the first line is 'time,north': allowed is 'time [s],north [m/s],east [m/s],down [m/s]' or",
    ),
    "turbulence_extent": ("planes", "turbulence_extent = 'planes': allowed are point, rates, field"),
    "roughness_length": (-1.0, "roughness_length = -1.0: allowed are 1e-06 to 10 m"),
    "gust_length": (float("nan"), "gust_length = nan: allowed are 0 to 1e+06 m"),
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

    log = fly(tmp_path, act)
    assert_identical(log)
    winds = [event.wind for event in flight_of(read(log)).events if event.kind == "wind"]
    assert [wind.turbulence_extent for wind in winds] == ["field", "rates", "point", "point", "point"]
    assert winds[0].turbulence_seed == 2**63 + 1
    assert winds[1].turbulence_span == sbs.rotor_span
    assert winds[1].turbulence_model == "von_karman"
    assert (winds[2].gust_shape, winds[2].gust_length) == ("ramp", 2.0)
    assert np.any(winds[2].gust_origin)
    expected = GustTable("distance", [0.0, 2.5, 5.0], [[0, 0, 0], [0, 0, -1.5], [0.5, 0, 0]])
    assert winds[3].own_gust == expected
    assert (winds[4].wind_profile, winds[4].profile_exponent, winds[4].own_gust) == ("power", 0.3, None)
    assert len({event.step for event in flight_of(read(log)).events if event.kind == "wind"}) == len(winds)
