"""The control law of the envelope controller: from hover to cruise and back, compiled (theory.md section 11).

A cascade. Outer loops turn errors of the velocity along and across the heading into a pitch and a roll angle, those of
the height into a climb; in a turn the bank follows from speed and turn rate. The inner loop holds these, the heading
and the climb by state feedback with integrals, whose gains were found by LQR, and moves the controls of the four axes
about their trim through a lag. Trims and gains are interpolated over the airspeed that is asked for: the reference of
the forward speed and the wind along it. So no error of the speed changes them.

Numbers are in one array, as `sbs_sim.flight.controller.Controller` has it: a header, the ranges of the controls, a
block for each airspeed, and commands.
"""

import math

from sbs_sim.flight import measured as M
from sbs_sim.model.kernel import entry, kernel

# header
SPEEDS, CONTROLS, PERIOD, GRAVITY, AXES = 0, 1, 2, 3, 4  # AXES: of four controls
FILTER, ACCELERATION, CLIMB_ACCELERATION, TURN_ACCELERATION, TILT = 8, 9, 10, 11, 12
BLEND_FROM, BLEND_TO, APPROACH, APPROACH_SPEED, CLIMB_SPEED = 13, 14, 15, 16, 17
TURN_RATE, HASTE, WIND_TIME, COMMANDS = 18, 19, 20, 21
HEADER = COMMANDS + 1
# block of an airspeed: it, trimmed controls, pitch, roll, then gains
AXIS_COUNT, FED_BACK, INTEGRALS = 4, 7, 4
VELOCITY_GAIN, VELOCITY_INTEGRAL, HEIGHT_GAIN = 0, 1, 2
OUTER_GAINS = 3
GAINS = AXIS_COUNT * (FED_BACK + INTEGRALS + AXIS_COUNT)
# command: time from which it holds, mode, and four numbers
COMMAND_SIZE = 6
VELOCITY, POSITION, ATTITUDE = 0.0, 1.0, 2.0
# memory
STARTED, DEPARTURE, INTEGRAL, VELOCITY_ERROR = 0, 1, 5, 9  # one, four, four, two numbers
FORWARD_REFERENCE, RIGHT_REFERENCE, DOWN_SPEED_REFERENCE, DOWN_REFERENCE = 11, 12, 13, 14
HEADING_REFERENCE, TURN_REFERENCE, WIND, PITCH_COMMAND, ROLL_COMMAND = 15, 16, 17, 18, 19
MEMORY = 20
LEASH, TURN_LEASH = 3.0, math.radians(30.0)  # m, rad, that references may be ahead
SMALL = 1e-6


def block_size(controls: int) -> int:
    """Numbers of the block of an airspeed."""
    return 1 + controls + 2 + GAINS + OUTER_GAINS


@kernel
def wrapped(angle):
    """An angle between -pi and pi."""
    return angle - 2.0 * math.pi * math.floor(angle / (2.0 * math.pi) + 0.5)


@kernel
def clipped(value, most):
    """A value of at most a magnitude."""
    return min(max(value, -most), most)


@kernel
def horizontal(u, v, w, roll, pitch):
    """Velocity along and across the heading, and down, of one in body axes."""
    aside = v * math.sin(roll) + w * math.cos(roll)
    forward = u * math.cos(pitch) + aside * math.sin(pitch)
    return forward, v * math.cos(roll) - w * math.sin(roll), aside * math.cos(pitch) - u * math.sin(pitch)


@entry
def envelope_law(time, measured, memory, parameters, controls):
    """See the module, and `sbs_sim.flight.controller.Controller`."""
    count, dt, gravity = int(parameters[CONTROLS]), parameters[PERIOD], parameters[GRAVITY]
    ranges, blocks = HEADER, HEADER + 2 * count
    size = 1 + count + 2 + GAINS + OUTER_GAINS
    speeds = int(parameters[SPEEDS])
    roll, pitch, heading = measured[M.ROLL], measured[M.PITCH], measured[M.HEADING]
    forward, right, down_speed = horizontal(measured[M.U], measured[M.V], measured[M.W], roll, pitch)
    ahead, aside, _ = horizontal(measured[M.U_AIR], measured[M.V_AIR], measured[M.W_AIR], roll, pitch)
    is_first = memory[STARTED] == 0.0
    if is_first:
        memory[STARTED] = 1.0
        memory[FORWARD_REFERENCE], memory[RIGHT_REFERENCE] = forward, right
        memory[DOWN_SPEED_REFERENCE], memory[DOWN_REFERENCE] = down_speed, measured[M.DOWN]
        memory[HEADING_REFERENCE], memory[WIND] = heading, ahead - forward

    # what is asked for now
    rows, row = blocks + speeds * size, -1
    for i in range(int(parameters[COMMANDS])):
        if time >= parameters[rows + i * COMMAND_SIZE] - SMALL:
            row = rows + i * COMMAND_SIZE
    mode, first, second, third, fourth = VELOCITY, 0.0, 0.0, 0.0, 0.0
    if row >= 0:
        mode, first, second = parameters[row + 1], parameters[row + 2], parameters[row + 3]
        third, fourth = parameters[row + 4], parameters[row + 5]
    wanted_down, wanted_turn = third, fourth
    if mode == POSITION:
        north, east = first - measured[M.NORTH], second - measured[M.EAST]
        c, s = math.cos(heading), math.sin(heading)
        along, across = c * north + s * east, c * east - s * north
        distance = math.sqrt(along * along + across * across)
        speed = min(parameters[APPROACH] * distance, parameters[APPROACH_SPEED])
        speed = min(speed, math.sqrt(parameters[ACCELERATION] * distance))
        first, second = along * speed / max(distance, SMALL), across * speed / max(distance, SMALL)
        wanted_down = clipped(parameters[APPROACH] * (third - memory[DOWN_REFERENCE]), parameters[CLIMB_SPEED])
        wanted_turn = wrapped(fourth - memory[HEADING_REFERENCE])
        wanted_turn = clipped(2.0 * parameters[APPROACH] * wanted_turn, parameters[TURN_RATE])

    # references
    memory[WIND] += -math.expm1(-dt / parameters[WIND_TIME]) * (ahead - forward - memory[WIND])
    blend = (ahead - parameters[BLEND_FROM]) / (parameters[BLEND_TO] - parameters[BLEND_FROM])
    blend = min(max(blend, 0.0), 1.0)
    along = across = 0.0
    haste = parameters[HASTE]
    if mode == ATTITUDE:
        memory[FORWARD_REFERENCE], memory[RIGHT_REFERENCE] = forward, right
    else:
        along = clipped(haste * (first - memory[FORWARD_REFERENCE]), parameters[ACCELERATION])
        across = clipped(haste * ((1.0 - blend) * second - memory[RIGHT_REFERENCE]), parameters[ACCELERATION])
        memory[FORWARD_REFERENCE] += dt * along
        memory[RIGHT_REFERENCE] += dt * across
    rise = clipped(haste * (wanted_down - memory[DOWN_SPEED_REFERENCE]), parameters[CLIMB_ACCELERATION])
    memory[DOWN_SPEED_REFERENCE] += dt * rise
    lead = memory[DOWN_REFERENCE] + dt * memory[DOWN_SPEED_REFERENCE] - measured[M.DOWN]
    memory[DOWN_REFERENCE] = measured[M.DOWN] + clipped(lead, LEASH)
    turn = clipped(2.0 * haste * (wanted_turn - memory[TURN_REFERENCE]), parameters[TURN_ACCELERATION])
    memory[TURN_REFERENCE] += dt * turn
    rate = memory[TURN_REFERENCE]
    lead = wrapped(memory[HEADING_REFERENCE] + dt * rate - heading)
    memory[HEADING_REFERENCE] = heading + clipped(lead, TURN_LEASH)

    # numbers of this airspeed, between those of two
    airspeed = memory[FORWARD_REFERENCE] + memory[WIND]
    low = 0
    for i in range(speeds - 1):
        if airspeed >= parameters[blocks + i * size]:
            low = i
    high = min(low + 1, speeds - 1)
    one, other = blocks + low * size, blocks + high * size
    share = 0.0
    if high > low:
        share = min(max((airspeed - parameters[one]) / (parameters[other] - parameters[one]), 0.0), 1.0)
    attitude, gains, outer = 1 + count, 3 + count, 3 + count + GAINS
    trim_pitch = between(parameters, one, other, share, attitude)
    trim_roll = between(parameters, one, other, share, attitude + 1)
    velocity_gain = between(parameters, one, other, share, outer + VELOCITY_GAIN)
    velocity_integral = between(parameters, one, other, share, outer + VELOCITY_INTEGRAL)
    height_gain = between(parameters, one, other, share, outer + HEIGHT_GAIN)

    # outer loops
    slow, slip = memory[FORWARD_REFERENCE] - forward, memory[RIGHT_REFERENCE] - (right + blend * (aside - right))
    if mode == ATTITUDE:
        slow = slip = 0.0
        share_of_command = -math.expm1(-dt * 2.0 * haste)
        memory[PITCH_COMMAND] += share_of_command * (second - memory[PITCH_COMMAND])
        memory[ROLL_COMMAND] += share_of_command * (first - memory[ROLL_COMMAND])
        nose, bank = memory[PITCH_COMMAND], memory[ROLL_COMMAND]
    else:
        memory[PITCH_COMMAND] = memory[ROLL_COMMAND] = 0.0
        nose = -(along + velocity_gain * slow + velocity_integral * memory[VELOCITY_ERROR]) / gravity
        bank = (across + velocity_gain * slip + velocity_integral * memory[VELOCITY_ERROR + 1]) / gravity
        bank += math.atan(forward * rate / gravity)
    nose_kept, bank_kept = clipped(nose, parameters[TILT]), clipped(bank, parameters[TILT])
    climb = memory[DOWN_SPEED_REFERENCE] + height_gain * (memory[DOWN_REFERENCE] - measured[M.DOWN])

    # inner loop
    errors = (
        down_speed - climb,
        measured[M.Q] - rate * math.sin(roll) * math.cos(pitch),
        pitch - trim_pitch - nose_kept,
        measured[M.P] + rate * math.sin(pitch),
        roll - trim_roll - bank_kept,
        measured[M.R] - rate * math.cos(roll) * math.cos(pitch),
        wrapped(heading - memory[HEADING_REFERENCE]),
    )
    new = -math.expm1(-dt / parameters[FILTER])
    is_free = True
    fed_back = gains + AXIS_COUNT * FED_BACK
    lagged = fed_back + AXIS_COUNT * INTEGRALS
    change = (0.0, 0.0, 0.0, 0.0)
    for k in range(AXIS_COUNT):
        wanted = 0.0
        for i in range(FED_BACK):
            wanted -= between(parameters, one, other, share, gains + k * FED_BACK + i) * errors[i]
        for i in range(INTEGRALS):
            wanted -= between(parameters, one, other, share, fed_back + k * INTEGRALS + i) * memory[INTEGRAL + i]
        for i in range(AXIS_COUNT):
            wanted -= between(parameters, one, other, share, lagged + k * AXIS_COUNT + i) * memory[DEPARTURE + i]
        axis = int(parameters[AXES + k])
        trim = between(parameters, one, other, share, 1 + axis)
        kept = min(max(wanted, parameters[ranges + axis] - trim), parameters[ranges + count + axis] - trim)
        is_free = is_free and kept == wanted
        if k == 0:
            change = (kept, change[1], change[2], change[3])
        elif k == 1:
            change = (change[0], kept, change[2], change[3])
        elif k == 2:
            change = (change[0], change[1], kept, change[3])
        else:
            change = (change[0], change[1], change[2], kept)
    for k in range(AXIS_COUNT):
        memory[DEPARTURE + k] += new * (change[k] - memory[DEPARTURE + k])
    if is_free:  # integrals that cannot act would only wind up
        memory[INTEGRAL] += dt * errors[2]
        memory[INTEGRAL + 1] += dt * errors[4]
        memory[INTEGRAL + 2] += dt * errors[0]
        memory[INTEGRAL + 3] += dt * errors[6]
        if nose == nose_kept:
            memory[VELOCITY_ERROR] += dt * slow
        if bank == bank_kept:
            memory[VELOCITY_ERROR + 1] += dt * slip
    for i in range(count):
        controls[i] = between(parameters, one, other, share, 1 + i)
    for k in range(AXIS_COUNT):
        controls[int(parameters[AXES + k])] += memory[DEPARTURE + k]


@kernel
def between(parameters, one, other, share, index):
    """A number of two blocks, interpolated."""
    first = parameters[one + index]
    return first + share * (parameters[other + index] - first)
