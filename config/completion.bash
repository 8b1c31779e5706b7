# Completion for bash: source this file, or evaluate what `./run completion` or `sbs-sim completion` prints.
# Made by tools/make_completion.py: do not edit.
# shellcheck shell=bash disable=SC2207  # no completion has blanks in it

_sbs_sim_names='simulator control_mixer analysis hover_hold excite frames teleop joystick replay cockpit ardupilot trim linearize sweep qualities identify performance stitch design batch reproduce validate gusts plot airfoil aircraft'
_sbs_sim_own='build test shell python completion --help --version'
_sbs_sim_aircraft='caradonna_tung castles_gray coaxial hammond harrington ormiston_hodges pca2 quadrotor sbs sbs_ducted sbs_paper tandem uh60a_genhel uh60a_tm85890'
_sbs_sim_conditions='airspeed climb_rate sideslip_deg turn_rate_deg'
_sbs_sim_paths='environment.air_density environment.kinematic_viscosity environment.gravity environment.speed_of_sound environment.altitude environment.temperature_offset body.mass body.inertia body.flat_plate_areas body.surfaces body.fuselage.reference body.fuselage.alpha_deg body.fuselage.beta_deg body.fuselage.drag.alpha body.fuselage.drag.beta body.fuselage.drag.grid body.fuselage.side.alpha body.fuselage.side.beta body.fuselage.side.grid body.fuselage.lift.alpha body.fuselage.lift.beta body.fuselage.lift.grid body.fuselage.roll.alpha body.fuselage.roll.beta body.fuselage.roll.grid body.fuselage.pitch.alpha body.fuselage.pitch.beta body.fuselage.pitch.grid body.fuselage.yaw.alpha body.fuselage.yaw.beta body.fuselage.yaw.grid body.fuselage.wash.rotor body.fuselage.wash.skew_deg body.fuselage.wash.down body.fuselage.wash.aft body.stand.free body.stand.mass body.stand.spring body.stand.damping options.coupling options.hub_moment options.flap_inertia options.elements options.interpolation options.interference controls.collective.range_deg controls.lateral_cyclic.range_deg controls.longitudinal_cyclic.range_deg controls.differential_longitudinal_cyclic.range_deg rotors.name rotors.hub rotors.shaft_direction rotors.rotation rotors.speed_rpm rotors.radius rotors.blades rotors.blade_mass rotors.blade_cg rotors.blade_inertia rotors.mass_distribution.stations rotors.mass_distribution.values rotors.mass_distribution.tip_mass rotors.hinge_offset rotors.flap_hinge_offset rotors.flap_hinge rotors.undersling rotors.flap_spring rotors.lag_spring rotors.flap_rest_deg rotors.lag_rest_deg rotors.lag_damping rotors.blade_lag_damping rotors.lag_damper.damping rotors.lag_damper.a rotors.lag_damper.b rotors.lag_damper.c rotors.lag_damper.d rotors.lag_damper.r rotors.lag_stop.range_deg rotors.lag_stop.stiffness rotors.lag_stop.damping rotors.pitch_flap_coupling rotors.pitch_lag_coupling rotors.chord.root rotors.chord.tip rotors.chord.stations rotors.chord.values rotors.twist_deg.root rotors.twist_deg.tip rotors.twist_deg.stations rotors.twist_deg.values rotors.quarter_chord.root rotors.quarter_chord.tip rotors.quarter_chord.stations rotors.quarter_chord.values rotors.chordwise_cg.root rotors.chordwise_cg.tip rotors.chordwise_cg.stations rotors.chordwise_cg.values rotors.root_cutout rotors.tip_loss rotors.tip_loss_model rotors.profile_drag rotors.unsteady_airfoil rotors.dynamic_stall rotors.stall_lags.pressure rotors.stall_lags.separation rotors.stall_lags.vortex rotors.stall_lags.passage rotors.swashplate_phase_deg rotors.airfoil rotors.drag_increment rotors.outboard_airfoils.stations rotors.outboard_airfoils.values rotors.duct_expansion rotors.duct.exit_area rotors.duct.turning rotors.duct.ram_recovery rotors.duct.lip_arm rotors.duct.lip_stall rotors.induced_power_factor rotors.descent rotors.ring_unsteadiness rotors.collective_range_deg rotors.cyclic_range_deg rotors.swashplate_rate_deg rotors.mixing.collective rotors.mixing.lateral_cyclic rotors.mixing.longitudinal_cyclic rotors.swashplate_offset_deg.collective rotors.swashplate_offset_deg.lateral_cyclic rotors.swashplate_offset_deg.longitudinal_cyclic rotors.schedule ground.contact ground.effect ground.altitude ground.slope_deg ground.slope_heading_deg contact_points.name contact_points.position contact_points.stiffness contact_points.damping contact_points.onset contact_points.side_stiffness contact_points.side_damping contact_points.friction contact_points.rolling contact_points.rolling_friction drives'

_sbs_sim_options() {
    case $1 in
        'simulator' | 'control_mixer' | 'analysis' | 'hover_hold' | 'excite' | 'frames' | 'teleop' | 'joystick') echo '--help --version --ros-args' ;;
        'replay') echo '--help --version --rate --start --end --flight --loop --topics --delay --verify --recover --set --out' ;;
        'cockpit') echo '--help --version --host --port --attach --foxglove --logs' ;;
        'ardupilot') echo '--help --version --parameters --out --aircraft --servos' ;;
        'trim') echo '--help --version --aircraft --set --airspeed --climb-rate --sideslip-deg --turn-rate-deg --no-lead-lag --no-cyclic-inflow --azimuth-count --guess-deg --method --json' ;;
        'linearize') echo '--help --version --aircraft --set --airspeed --climb-rate --sideslip-deg --turn-rate-deg --no-lead-lag --no-cyclic-inflow --azimuth-count --guess-deg --method --quasi-static --bode --delay --actuator --bode-out --harmonics --at --harmonics-out --reduce --reduced-out --matrices --derivatives --participation --floquet --out --json' ;;
        'sweep') echo '--help --version --values --over --aircraft --set --airspeed --climb-rate --sideslip-deg --turn-rate-deg --no-lead-lag --no-cyclic-inflow --azimuth-count --guess-deg --trims-only --workers --dask --out --csv --json' ;;
        'qualities') echo '--help --version --aircraft --set --airspeeds --delay --actuator --scale-length --attitude-command --controller --bare --workers --json --out' ;;
        'identify') echo '--help --version --flight --response --inputs --from --to --feedback --references --held --low --high --points --windows --period --method --linear --airspeed --fit --fit-delay --integrators --csv --json --out' ;;
        'performance') echo '--help --version --aircraft --set --airspeeds --masses --altitudes --power --no-lead-lag --no-cyclic-inflow --workers --csv --out' ;;
        'stitch') echo '--help --version --airspeeds --climb-rates --aircraft --set --states --no-lead-lag --no-cyclic-inflow --azimuth-count --workers --no-check --out' ;;
        'design') echo '--help --version --aircraft --set --airspeeds --gain-margin --phase-margin --delay --lag --limit --samples --seed --uncertain --workers --out --json' ;;
        'batch') echo '--help --version --flights --duration --turbulence --length --spectrum --extent --severity --height --gust-file --seed --spread --aircraft --set --airspeed --climb-rate --sideslip-deg --turn-rate-deg --no-lead-lag --no-cyclic-inflow --azimuth-count --controller --delay --lag --noise --bias --workers --dask --every --out --csv --json' ;;
        'reproduce') echo '--help --version --aircraft --paper-aircraft --json --out' ;;
        'validate') echo '--help --version --list --json --page --strict' ;;
        'gusts') echo '--help --version --aircraft --set --wind --turbulence --length --gust --gust-duration --spectrum --extent --severity --height --gust-file --rule --gradient --seed --duration --delay --limit --json' ;;
        'plot') echo '--help --version --out --flight --resimulate --set --azimuth-step-deg --linear' ;;
        'airfoil') echo '--help --version --out --extend --aspect-ratio --over --reynolds' ;;
        'aircraft') echo '--help --version --aircraft --set --out' ;;
    esac
}

_sbs_sim_follows() {
    case $1 in
        'replay' | 'replay --out' | 'cockpit --logs' | 'ardupilot --out' | 'ardupilot --aircraft' | 'ardupilot --servos' | 'trim --json' | 'linearize --bode-out' | 'linearize --harmonics-out' | 'linearize --reduced-out' | 'linearize --out' | 'linearize --json' | 'sweep --out' | 'sweep --csv' | 'sweep --json' | 'qualities --controller' | 'qualities --json' | 'qualities --out' | 'identify' | 'identify --csv' | 'identify --json' | 'identify --out' | 'performance --csv' | 'performance --out' | 'stitch --out' | 'design --out' | 'design --json' | 'batch --gust-file' | 'batch --out' | 'batch --csv' | 'batch --json' | 'reproduce --json' | 'reproduce --out' | 'validate --json' | 'validate --page' | 'gusts --gust-file' | 'gusts --json' | 'plot' | 'plot --out' | 'airfoil' | 'airfoil --out' | 'aircraft --out') echo '@files' ;;
        'replay --set' | 'trim --set' | 'linearize --set' | 'sweep --set' | 'qualities --set' | 'performance --set' | 'stitch --set' | 'design --set' | 'batch --spread' | 'batch --set' | 'gusts --set' | 'plot --set' | 'aircraft --set') echo '@assigned' ;;
        'trim --aircraft' | 'linearize --aircraft' | 'sweep --aircraft' | 'qualities --aircraft' | 'identify --inputs' | 'identify --references' | 'identify --held' | 'performance --aircraft' | 'stitch --aircraft' | 'design --aircraft' | 'batch --aircraft' | 'reproduce --aircraft' | 'reproduce --paper-aircraft' | 'gusts --aircraft' | 'aircraft --aircraft') echo '@aircraft' ;;
        'trim --method') echo 'newton two_loop' ;;
        'linearize --method') echo 'averaged paper' ;;
        'sweep') echo '@paths' ;;
        'identify --feedback') echo 'auto direct joint' ;;
        'identify --method') echo 'chirp_z welch' ;;
        'batch --spectrum' | 'gusts --spectrum') echo 'dryden von_karman' ;;
        'batch --extent' | 'gusts --extent') echo 'point rates field elements' ;;
        'batch --severity' | 'gusts --severity') echo 'light moderate severe' ;;
        'gusts --rule') echo 'cs25 cs27 cs29' ;;
        'airfoil --extend') echo 'viterna montgomerie plate hold none' ;;
        'airfoil --over') echo 'reynolds mach' ;;
    esac
}

_sbs_sim_parameters() {
    case $1 in
        'simulator' | 'cockpit') echo 'aircraft:= components:= airspeed:= climb_rate:= sideslip:= turn_rate:= heading:= altitude:= rotor_speed:= on_ground:= ground_altitude:= real_time_factor:= publish_rate:= method:= model:= stitched_file:= stitched_airspeeds:= stitched_states:= azimuth_step_deg:= lead_lag:= cyclic_inflow:= command_timeout:= record:= wind:= wind_profile:= reference_height:= roughness_length:= profile_exponent:= turbulence:= turbulence_model:= turbulence_extent:= turbulence_seed:= foxglove:= foxglove_port:= foxglove_control:= gust_file:= simulation_interfaces:= sensors.seed:= sensors.latitude_deg:= sensors.longitude_deg:= sensors.height:= imu.rate:= imu.latency:= imu.correlation_time:= imu.gyro_noise:= imu.gyro_bias:= imu.gyro_instability:= imu.gyro_resolution:= imu.accel_noise:= imu.accel_bias:= imu.accel_instability:= imu.accel_resolution:= imu.attitude_noise:= imu.attitude_bias:= imu.attitude_instability:= imu.position:= gnss.rate:= gnss.latency:= gnss.correlation_time:= gnss.noise:= gnss.bias:= gnss.instability:= gnss.vertical_ratio:= pressure.rate:= pressure.latency:= pressure.correlation_time:= pressure.noise:= pressure.bias:= pressure.instability:= pressure.resolution:= magnetic.rate:= magnetic.latency:= magnetic.correlation_time:= magnetic.noise:= magnetic.bias:= magnetic.instability:= magnetic.resolution:= magnetic.field:= range.rate:= range.latency:= range.correlation_time:= range.noise:= range.bias:= range.instability:= range.resolution:= range.limits:= battery.rate:= battery.latency:= battery.correlation_time:= battery.noise:= battery.bias:= battery.instability:= battery.resolution:=' ;;
        'control_mixer' | 'analysis') echo 'aircraft:=' ;;
        'hover_hold') echo 'largest_distance:= patience:= position_limit:= gains:= command_timeout:=' ;;
        'excite') echo 'aircraft:= controls:= signal:= amplitude_deg:= low:= high:= duration:= period:= periods:= pause:=' ;;
        'frames') echo 'aircraft:= rate:= frame_prefix:= imu.position:= joint_frames:=' ;;
        'teleop') echo 'aircraft:= augmentation:= expo:= collective_deg:= cyclic_deg:= differential_deg:=' ;;
        'joystick') echo 'aircraft:= augmentation:= config:= pad:=' ;;
        'ardupilot') echo 'aircraft:= components:= airspeed:= climb_rate:= sideslip:= turn_rate:= heading:= altitude:= rotor_speed:= on_ground:= ground_altitude:= real_time_factor:= publish_rate:= method:= model:= stitched_file:= stitched_airspeeds:= stitched_states:= azimuth_step_deg:= lead_lag:= cyclic_inflow:= record:= wind:= wind_profile:= reference_height:= roughness_length:= profile_exponent:= turbulence:= turbulence_model:= turbulence_extent:= turbulence_seed:= foxglove:= foxglove_port:= foxglove_control:= gust_file:= simulation_interfaces:= sensors.seed:= sensors.latitude_deg:= sensors.longitude_deg:= sensors.height:= imu.rate:= imu.latency:= imu.correlation_time:= imu.gyro_noise:= imu.gyro_bias:= imu.gyro_instability:= imu.gyro_resolution:= imu.accel_noise:= imu.accel_bias:= imu.accel_instability:= imu.accel_resolution:= imu.attitude_noise:= imu.attitude_bias:= imu.attitude_instability:= imu.position:= gnss.rate:= gnss.latency:= gnss.correlation_time:= gnss.noise:= gnss.bias:= gnss.instability:= gnss.vertical_ratio:= pressure.rate:= pressure.latency:= pressure.correlation_time:= pressure.noise:= pressure.bias:= pressure.instability:= pressure.resolution:= magnetic.rate:= magnetic.latency:= magnetic.correlation_time:= magnetic.noise:= magnetic.bias:= magnetic.instability:= magnetic.resolution:= magnetic.field:= range.rate:= range.latency:= range.correlation_time:= range.noise:= range.bias:= range.instability:= range.resolution:= range.limits:= battery.rate:= battery.latency:= battery.correlation_time:= battery.noise:= battery.bias:= battery.instability:= battery.resolution:= frame_rate:= port:= servos:=' ;;
    esac
}

_sbs_sim_words() {
    COMPREPLY=($(compgen -W "$1" -- "$2"))
}

# What may follow an option, or be the first argument: words, or what a mark represents.
_sbs_sim_value() {
    local word=$2
    case $1 in
        @files) compopt -o default ;;
        @aircraft) compopt -o default; _sbs_sim_words "$_sbs_sim_aircraft" "$word" ;;
        @paths) _sbs_sim_words "$_sbs_sim_conditions $_sbs_sim_paths" "$word" ;;
        @assigned) compopt -o nospace; _sbs_sim_words "${_sbs_sim_paths// /= }=" "$word" ;;
        *) _sbs_sim_words "$1" "$word" ;;
    esac
}

# Completes the arguments of executable $1, whose name is word $2 of the line.
_sbs_sim_arguments() {
    local name=$1 place=$2 word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD - 1]} ros='' i
    [[ $before == '=' ]] && before=${COMP_WORDS[COMP_CWORD - 2]}
    [[ $word == '=' ]] && word=''
    for ((i = place + 1; i < COMP_CWORD; i++)); do
        [[ ${COMP_WORDS[i]} == --ros-args ]] && ros=yes
    done
    if [[ -n $ros && ($before == -p || $before == --param) ]]; then
        compopt -o nospace
        _sbs_sim_words "$(_sbs_sim_parameters "$name")" "$word"
    elif [[ -n $ros ]]; then
        _sbs_sim_words '-p -r --params-file --log-level' "$word"
    elif [[ -n $(_sbs_sim_follows "$name $before") ]]; then
        _sbs_sim_value "$(_sbs_sim_follows "$name $before")" "$word"
    elif [[ $word == -* ]]; then
        _sbs_sim_words "$(_sbs_sim_options "$name")" "$word"
    elif [[ -n $(_sbs_sim_follows "$name") ]]; then
        _sbs_sim_value "$(_sbs_sim_follows "$name")" "$word"
    fi
}

_sbs_sim() {
    COMPREPLY=()
    if ((COMP_CWORD == 1)); then
        _sbs_sim_words "$_sbs_sim_names completion --help --version" "${COMP_WORDS[1]}"
    else
        _sbs_sim_arguments "${COMP_WORDS[1]}" 1
    fi
}

# ./run of any clone; other programs of that name are left to what bash does without this.
_sbs_sim_run() {
    local script
    COMPREPLY=()
    script=$(readlink -f -- "${COMP_WORDS[0]}" 2>/dev/null)
    if [[ ! -r ${script%/*}/config/completion.bash || ${COMP_WORDS[0]} != */* ]]; then
        compopt -o default
    elif ((COMP_CWORD == 1)); then
        _sbs_sim_words "$_sbs_sim_names $_sbs_sim_own" "${COMP_WORDS[1]}"
    else
        case ${COMP_WORDS[1]} in
            test | shell | python) compopt -o default ;;
            *) _sbs_sim_arguments "${COMP_WORDS[1]}" 1 ;;
        esac
    fi
}

complete -F _sbs_sim sbs-sim
complete -F _sbs_sim_run run
