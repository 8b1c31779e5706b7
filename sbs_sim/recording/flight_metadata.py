"""What a log holds of a simulation besides its messages: options, and the files of the aircraft."""

import io

from ruamel.yaml import YAML

from sbs_sim.aircraft import Aircraft
from sbs_sim.flight.simulation import Simulation
from sbs_sim.flight.stitched_file import encoded

AIRCRAFT_FILE = "aircraft.yaml"
AIRFOIL_FOLDER = "airfoils"
STITCHED_FILE = "stitched.npz"


def simulation_metadata(simulation: Simulation) -> dict[str, str]:
    """Options of a simulation as text that gives back their bits."""
    return {
        "aircraft": simulation.aircraft.name,
        "parameter_hash": simulation.aircraft.parameter_hash,
        **{name: str(value) for name, value in simulation.options.items()},
        "step_size": repr(simulation.step_size),
        "steps_per_tick": repr(simulation.steps_per_tick),
    }


def simulation_attachments(simulation: Simulation) -> dict[str, bytes]:
    """The aircraft as files, and the stitched model if it flies."""
    files = attachments(simulation.aircraft)
    return files if simulation.stitched is None else {**files, STITCHED_FILE: encoded(simulation.stitched)}


def attachments(aircraft: Aircraft) -> dict[str, bytes]:
    """The aircraft as files: its own and those of its airfoils."""
    data, files = aircraft.files()
    text = io.BytesIO()
    writer = YAML(typ="safe", pure=True)
    writer.sort_base_mapping_type_on_output = False  # type: ignore[assignment]  # pilot controls have an order
    writer.dump(data, text)
    return {AIRCRAFT_FILE: text.getvalue(), **{f"{AIRFOIL_FOLDER}/{name}": content for name, content in files.items()}}
