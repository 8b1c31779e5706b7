"""Columns of the air of a tick, see `sbs_sim.model.wind`."""

STEADY, GUST, GUST_START, GUST_DURATION, TURBULENCE_FROM, TURBULENCE_TO = 0, 3, 6, 7, 8, 11
RATES_FROM, RATES_TO = 14, 17  # angular velocity of the air, NED [rad/s]
WIND_SIZE = 20
