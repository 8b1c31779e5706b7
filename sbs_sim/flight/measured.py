"""What a control law measures, in order: `measured[PITCH]` is the pitch angle."""

NORTH, EAST, DOWN, ROLL, PITCH, HEADING, U, V, W, P, Q, R, U_AIR, V_AIR, W_AIR = range(15)
NAMES = (
    *("north", "east", "down"),  # m
    *("phi", "theta", "psi"),  # rad; roll and heading from -pi to pi
    *("u", "v", "w"),  # m/s over ground, body axes
    *("p", "q", "r"),  # rad/s
    *("u_air", "v_air", "w_air"),  # m/s against the air at the c.g., body axes
)
COUNT = len(NAMES)
