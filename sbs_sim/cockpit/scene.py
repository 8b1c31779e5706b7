"""The aircraft in three dimensions: what a `Snapshot` says, as nodes of a viser scene.

The scene is carried by the aircraft: the c.g. stays at the origin and the earth moves, so that the view follows a
flight while the camera belongs to the user. The first node turns NED axes into those of the viewer, whose z is up.
Lengths of what is no part of an aircraft, arrows and cells of grids, go with its size.
"""

import collections
import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray
from viser import ViserServer
from viser.transforms import SO3

from sbs_sim.aircraft import Aircraft
from sbs_sim.aircraft.description import Rotor
from sbs_sim.cockpit import geometry
from sbs_sim.flight.records import Snapshot
from sbs_sim.model import records as R
from sbs_sim.model import state as S
from sbs_sim.model.frames import hub_axes
from sbs_sim.model.multiblade import blade_matrix

Array = NDArray[np.float64]

NED_TO_VIEW = (0.0, 1.0, 0.0, 0.0)  # half turn about north
SKY, GROUND, GRID, SECTION = (233, 240, 246), (214, 220, 212), (196, 203, 195), (160, 168, 160)
FUSELAGE, DUCT, BLADE, FIRST_BLADE = (92, 104, 118), (150, 160, 170), (52, 60, 70), (213, 94, 0)
THRUST, MOMENT, PATH, TRAIL = (0, 114, 178), (204, 121, 167), (0, 158, 115), (90, 100, 110)
AMBIENT, SUN = 1.9, 1.6  # of light; together they show the colours of what faces up as they are
TO_SUN = (-2.0, -1.0, -4.0)  # NED
OPEN_ROTOR = 0.5  # duct_expansion of a rotor without a duct
REFERENCE_SIZE = 1.15  # m from the c.g. to the furthest tip: of the aircraft that the lengths below are for
FOG = (60.0, 400.0)  # m
GRID_SIZE = 2000.0  # m
LEVEL_FADE = 60.0  # m, at which the grid at the origin's height has faded
THIN = 0.02  # m: planes that are nearer to each other than this are one
RINGS, SECTORS, PATH_POINTS = 4, 24, 60
TRAIL_PERIOD, TRAIL_POINTS = 0.25, 240  # s of simulation time between points
RESET_DISTANCE, RESET_SPEED = 0.5, 100.0  # m and m/s: what is further or faster is no flight but a reset
ARROW_OF_WEIGHT = 0.5  # m, arrow of a rotor that carries its share of the weight
ARROW_OF_MOMENT = 6.0  # m, arrow of a moment of that share at 1 m
MIN_ARROW_LENGTH = 1e-3  # m
# Viridis (Smith and van der Walt) at nine points: lightness grows evenly, and all people see it alike.
COLOURS = np.array(
    [
        (68, 1, 84),
        (71, 44, 122),
        (59, 81, 139),
        (44, 113, 142),
        (33, 144, 141),
        (39, 173, 129),
        (92, 200, 99),
        (170, 220, 50),
        (253, 231, 37),
    ],
    dtype=float,
)


@dataclass
class Shown:
    """What the user wants to see.

    Attributes
    ----------
    magnification : float
        Of flap and lag angles.
    """

    magnification: float = 5.0
    ducts: bool = True
    paths: bool = True
    arrows: bool = True
    inflow: bool = True
    trail: bool = True


class Scene:
    """An aircraft, its rotors, the ground.

    Parameters
    ----------
    server : ViserServer
    aircraft : Aircraft
    shown : Shown
        May change at any time.
    name : str
        Of the node that holds it all. Each scene of a page wants its own: a node that is made again under its name
        keeps the pose that browsers have of it, unless the new one is another than none.
    """

    def __init__(self, server: ViserServer, aircraft: Aircraft, shown: Shown, name: str = "/ned") -> None:
        self.aircraft, self._shown, self._name = aircraft, shown, name
        self.scale = geometry.size(aircraft) / REFERENCE_SIZE
        self._scene = server.scene
        self._scene.add_frame(name, show_axes=False, wxyz=NED_TO_VIEW)
        self._earth = self._scene.add_frame(f"{name}/earth", show_axes=False)
        self._body = self._scene.add_frame(f"{name}/body", show_axes=False)
        _add_light(self._scene, name, self.scale)
        self._level, self._ground_plane = _add_grids(self._scene, name, self.scale, self.cell)
        self._ground: float | None = None
        self.set_ground(None)
        _add_fuselage(self._scene, name, aircraft, self.scale)
        weight = aircraft.body.mass * aircraft.environment.gravity or 1.0  # N; there may be no gravity
        share = weight / len(aircraft.rotors)
        self.newtons_per_metre = share / (ARROW_OF_WEIGHT * self.scale)
        self.moment_per_metre = share / ARROW_OF_MOMENT
        self._rotors = [
            RotorNodes(self._scene, f"{name}/body/rotor{j}", rotor, self) for j, rotor in enumerate(aircraft.rotors)
        ]
        self._trail = Trail(self._scene, name)
        mass_flow = 2 * aircraft.environment.air_density * sum(math.pi * rotor.radius**2 for rotor in aircraft.rotors)
        induced = math.sqrt(weight / mass_flow) if mass_flow else 1.0  # of hover by momentum theory [m/s]; or a vacuum
        self.inflow_range = (0.0, float(math.ceil(2 * induced)))

    def has_duct(self, rotor: Rotor) -> bool:
        """True if a rotor is drawn with a duct: one that carries load, or the file's words, for it may carry none."""
        return rotor.wake_expansion != OPEN_ROTOR or "duct" in self.aircraft.description.lower()

    @property
    def cell(self) -> float:
        """Width of the grids' cells: a power of ten near the aircraft's size [m]."""
        return float(10.0 ** math.floor(math.log10(self.scale) + 0.3))

    @property
    def lines(self) -> list[str]:
        """What the lines of the grids are, in words."""

        def apart(cell: float) -> str:
            return f"lines {cell:g} m and {10.0 * cell:g} m apart"

        labels = [f"height of the origin: {apart(self.cell)}"] if self._level.visible else []
        if self._ground is not None:
            side = "below" if self._ground < 0.0 else "above"
            where = f"{abs(self._ground):g} m {side} the origin" if self._level.visible else "at the origin's height"
            labels.append(f"ground, {where}: {apart(float(self._ground_plane.cell_size))}")
        return labels

    def set_ground(self, altitude: float | None) -> None:
        """Draw the ground at a height above the origin [m], or none; the grid at the origin's height stays."""
        self._ground = altitude
        self._ground_plane.visible = altitude is not None
        self._level.visible = altitude is None or abs(altitude) > THIN * self.scale
        if altitude is not None:
            self._ground_plane.position = (0.0, 0.0, -altitude)
            slope, heading = self.aircraft.ground.slope, self.aircraft.ground.slope_heading
            half, tilt = math.cos(slope / 2.0), math.sin(slope / 2.0)  # a turn that raises what is ahead, then upwards
            self._ground_plane.wxyz = (tilt * math.sin(heading), half, 0.0, -tilt * math.cos(heading))
            cell = self.cell if not self._level.visible else 10.0 * self.cell  # of what is seen from afar
            self._ground_plane.cell_size, self._ground_plane.section_size = cell, 10.0 * cell

    def draw(self, snapshot: Snapshot, lead: float = 0.0) -> None:
        """Show an instant.

        Parameters
        ----------
        snapshot : Snapshot
        lead : float
            Time since the instant, by which the rotors have turned on [s].
        """
        state, layout = snapshot.state, self.aircraft.layout
        self._body.wxyz = state[S.ATTITUDE : S.VELOCITY]
        self._earth.position = -state[S.POSITION : S.ATTITUDE]
        speeds = self.aircraft.rotor_speeds(state).tolist()
        for j, nodes in enumerate(self._rotors):
            azimuth = float(snapshot.azimuth[j]) + speeds[j] * lead
            nodes.draw_blades(azimuth, state[layout.flap(j)], state[layout.lag(j)], self._shown)
            nodes.draw_loads(snapshot.loads[j], self._shown)
            nodes.draw_inflow(state[layout.inflow(j)], self.inflow_range, self._shown)
        self._trail.draw(snapshot.time, state[S.POSITION : S.ATTITUDE], self._shown.trail)
        self._trail.draw_height(-float(state[S.POSITION + 2]) - self._ground_below(*state[: S.POSITION + 2].tolist()))

    def _ground_below(self, north: float, east: float) -> float:
        """Height above the origin of the ground, or of the origin's level, at a place [m]."""
        if self._ground is None:
            return 0.0
        ground = self.aircraft.ground
        uphill = north * math.cos(ground.slope_heading) + east * math.sin(ground.slope_heading)
        return self._ground + uphill * math.tan(ground.slope)

    def clear_trail(self) -> None:
        """Forget where the aircraft was."""
        self._trail.clear()

    def remove(self) -> None:
        """Take everything off the scene."""
        self._scene.remove_by_name(self._name)


class RotorNodes:
    """Blades, duct, tip path, arrows and inflow of one rotor, in body axes.

    Parameters
    ----------
    scene : SceneApi
    name : str
        Of the node that holds them.
    rotor : Rotor
    whole : Scene
        Which says how long arrows are.
    """

    def __init__(self, scene: Any, name: str, rotor: Rotor, whole: Scene) -> None:
        self._rotor, self._whole = rotor, whole
        self._up = np.asarray(rotor.shaft_direction) / np.linalg.norm(rotor.shaft_direction)
        hub = SO3.from_matrix(hub_axes(rotor.shaft_direction)).wxyz
        self._duct = _add_duct(scene, f"{name}/duct", rotor, hub) if whole.has_duct(rotor) else None
        self._blades = _add_blades(scene, f"{name}/blades", rotor)
        self._path = scene.add_line_segments(
            f"{name}/path", np.zeros((PATH_POINTS, 2, 3)), PATH, thickness=2.0, thickness_units="screen"
        )
        sizes = {"shaft_radius": 0.012, "head_radius": 0.032, "head_length": 0.07}
        sizes = {part: whole.scale * length for part, length in sizes.items()}
        still = np.array([[rotor.hub, rotor.hub]])
        self._thrust = scene.add_arrows(f"{name}/thrust", still, THRUST, **sizes)
        self._moment = scene.add_arrows(f"{name}/moment", still, MOMENT, **sizes)
        edges, self._cell_azimuths = geometry.inflow_cells(RINGS, SECTORS)
        self._cell_radii = 0.5 * (edges[1:] + edges[:-1])
        self._rings = [
            _add_ring(scene, f"{name}/inflow{i}", rotor, hub, edges[i : i + 2], self._cell_azimuths)
            for i in range(RINGS)
        ]
        self._last_inflow: Array | None = None

    def draw_blades(self, azimuth: float, flap: Array, lag: Array, shown: Shown) -> None:
        """Blades and tip path of multiblade coordinates [rad], shape (blades,)."""
        rotor, factor = self._rotor, shown.magnification
        matrix = blade_matrix(rotor.blades, azimuth)
        azimuths = geometry.blade_azimuths(rotor, azimuth)
        hinges, axes = geometry.blade_poses(rotor, azimuths, factor * (matrix @ flap), factor * (matrix @ lag))
        self._blades.batched_positions = hinges.astype(np.float32)
        self._blades.batched_wxyzs = np.array([SO3.from_matrix(one).wxyz for one in axes], dtype=np.float32)
        if self._duct is not None:
            _show(self._duct, shown.ducts)
        _show(self._path, shown.paths)
        if shown.paths:
            path = geometry.tip_path(rotor, flap, factor, PATH_POINTS)
            self._path.points = np.stack([path[:-1], path[1:]], axis=1).astype(np.float32)

    def draw_loads(self, loads: Array, shown: Shown) -> None:
        """Thrust along the shaft and moment on the hub."""
        for node, vector in (
            (self._thrust, loads[R.THRUST] / self._whole.newtons_per_metre * self._up),
            (self._moment, loads[R.MOMENT : R.MOMENT + 3] / self._whole.moment_per_metre),
        ):
            there = shown.arrows and float(np.linalg.norm(vector)) > MIN_ARROW_LENGTH * self._whole.scale
            _show(node, there)
            if there:
                node.points = np.array([[self._rotor.hub, self._rotor.hub + vector]], dtype=np.float32)

    def draw_inflow(self, inflow: Array, limits: tuple[float, float], shown: Shown) -> None:
        """Induced velocity over the disc in colour; sent on only when a colour changes."""
        for ring in self._rings:
            _show(ring, shown.inflow)
        if not shown.inflow:
            return
        radius, azimuth = np.meshgrid(self._cell_radii, self._cell_azimuths, indexing="ij")
        colours = colour_of(geometry.inflow_velocity(self._rotor, inflow, radius, azimuth), limits)
        if self._last_inflow is None or np.abs(colours.astype(int) - self._last_inflow).max() > 1:
            self._last_inflow = colours.astype(int)
            for ring, colour in zip(self._rings, colours, strict=True):
                ring.batched_colors = colour


class Trail:
    """Where the aircraft was lately.

    Parameters
    ----------
    scene : SceneApi
    name : str
        Of the node that holds everything.
    """

    def __init__(self, scene: Any, name: str) -> None:
        nothing = np.zeros((1, 2, 3))
        style: dict[str, Any] = {"thickness": 1.5, "thickness_units": "screen"}
        self._node = scene.add_line_segments(f"{name}/earth/trail", nothing, TRAIL, **style)
        self._height = scene.add_line_segments(f"{name}/height", nothing, TRAIL, **style)
        self._points: collections.deque[Array] = collections.deque(maxlen=TRAIL_POINTS)
        self._last = -math.inf
        self._before: tuple[float, Array] | None = None

    def clear(self) -> None:
        """Forget it."""
        self._points.clear()
        self._last, self._before = -math.inf, None

    def draw(self, time: float, position: Array, shown: bool) -> None:
        """Go on to a position, NED [m]; a reset, which no flight could do, begins a new trail."""
        if self._before is not None:
            since, last = self._before
            if time < since or math.dist(last, position) > RESET_DISTANCE + RESET_SPEED * (time - since):
                self.clear()
        self._before = (time, position.copy())
        if time - self._last >= TRAIL_PERIOD:
            self._last = time
            self._points.append(position.copy())
            points = np.array(self._points)
            if len(points) > 1:
                self._node.points = np.stack([points[:-1], points[1:]], axis=1).astype(np.float32)
        _show(self._node, shown and len(self._points) > 1)

    def draw_height(self, height: float) -> None:
        """Draw a plumb line of a length [m]."""
        self._height.points = np.array([[[0.0, 0.0, 0.0], [0.0, 0.0, height]]], dtype=np.float32)


def colour_of(values: Array, limits: tuple[float, float]) -> NDArray[np.uint8]:
    """Colours of values on a scale; beyond its ends those of the ends.

    Returns
    -------
    ndarray of uint8, shape (..., 3)
    """
    low, high = limits
    fractions = np.clip((values - low) / (high - low), 0.0, 1.0) * (len(COLOURS) - 1)
    channels = [np.interp(fractions, np.arange(len(COLOURS)), COLOURS[:, i]) for i in range(3)]
    return np.stack(channels, axis=-1).astype(np.uint8)


def _show(node: Any, wanted: bool) -> None:
    """Set the visibility only where it changes: every setting is a message."""
    if node.visible != wanted:
        node.visible = wanted


def _add_light(scene: Any, name: str, scale: float) -> None:
    """Sky, haze, light."""
    scene.set_background_image(np.full((2, 2, 3), SKY, dtype=np.uint8), format="png")
    scene.configure_fog(*(max(1.0, scale) * distance for distance in FOG), color=SKY)
    scene.configure_environment_map(None)  # its light would wash out the colours, which mean something here
    scene.configure_default_lights(False)
    scene.add_light_ambient(f"{name}/ambient", intensity=AMBIENT)
    scene.add_light_directional(f"{name}/sun", intensity=SUN, position=TO_SUN)


def _add_grids(scene: Any, name: str, scale: float, cell: float) -> tuple[Any, Any]:
    """Lines at the origin's height, through which one sees, and the ground; cells, and sections of ten."""

    def add(part: str, opacity: float, fade: float) -> Any:
        return scene.add_grid(
            f"{name}/earth/{part}",
            GRID_SIZE * max(1.0, scale),
            GRID_SIZE * max(1.0, scale),
            cell_size=cell,
            section_size=10.0 * cell,
            cell_color=GRID,
            section_color=SECTION,
            cell_thickness=0.6,
            section_thickness=1.0,
            fade_distance=fade * max(1.0, scale),
            plane_color=GROUND,
            plane_opacity=opacity,
            shadow_opacity=0.0,
            wxyz=NED_TO_VIEW,  # seen from above
        )

    return add("level", 0.0, LEVEL_FADE), add("ground", 1.0, FOG[1])


def _add_fuselage(scene: Any, name: str, aircraft: Aircraft, scale: float) -> None:
    """A body that shows where the nose is, and beams to the hubs."""
    length = 0.4 * geometry.size(aircraft)
    path = f"{name}/body/fuselage"
    scene.add_icosphere(path, 1.0, color=FUSELAGE, scale=(length, 0.26 * length, 0.24 * length), cast_shadow=False)
    scene.add_icosphere(
        f"{name}/body/nose",
        1.0,
        color=FIRST_BLADE,
        scale=(0.1 * length, 0.1 * length, 0.09 * length),
        position=(0.93 * length, 0.0, 0.0),
        cast_shadow=False,
    )
    for j, rotor in enumerate(aircraft.rotors):
        distance = float(np.linalg.norm(rotor.hub))
        if distance > 0.0:
            beam = trimesh.creation.cylinder(
                radius=0.018 * scale, segment=np.array([np.zeros(3), rotor.hub]), sections=12
            )
            scene.add_mesh_simple(
                f"{name}/body/beam{j}", beam.vertices, beam.faces, color=FUSELAGE, cast_shadow=False, side="double"
            )


def _add_duct(scene: Any, name: str, rotor: Rotor, hub: Array) -> Any:
    ring = trimesh.creation.annulus(1.03 * rotor.radius, 1.07 * rotor.radius, 0.2 * rotor.radius, sections=64)
    return scene.add_mesh_simple(
        name,
        ring.vertices,
        ring.faces,
        color=DUCT,
        opacity=0.25,
        side="double",
        cast_shadow=False,
        receive_shadow=False,
        wxyz=hub,
        position=rotor.hub,
    )


def _add_blades(scene: Any, name: str, rotor: Rotor) -> Any:
    """One mesh for all blades of a rotor; the first one has a colour of its own."""
    mesh = geometry.blade_mesh(rotor)
    colours = np.array([FIRST_BLADE] + [BLADE] * (rotor.blades - 1), dtype=np.uint8)
    return scene.add_batched_meshes_simple(
        name,
        mesh.vertices,
        mesh.faces,
        batched_wxyzs=np.tile([1.0, 0.0, 0.0, 0.0], (rotor.blades, 1)),
        batched_positions=np.zeros((rotor.blades, 3)),
        batched_colors=colours,
        lod="off",
        side="double",
        flat_shading=True,
        cast_shadow=False,
        receive_shadow=False,
    )


def _add_ring(scene: Any, name: str, rotor: Rotor, hub: Array, edges: Array, azimuths: Array) -> Any:
    """Cells of the disc between two radii [over R], one for each azimuth, in the hub plane."""
    mesh = geometry.sector_mesh(edges[0] * rotor.radius, edges[1] * rotor.radius, 2 * math.pi / len(azimuths))
    # azimuth 0 is aft, which is -x of the hub; it grows counter-clockwise from above, which is -z
    turns = [SO3.from_z_radians(math.pi - rotor.rotation * azimuth).wxyz for azimuth in azimuths]
    return scene.add_batched_meshes_simple(
        name,
        mesh.vertices,
        mesh.faces,
        batched_wxyzs=np.array(turns),
        batched_positions=np.zeros((len(azimuths), 3)),
        batched_colors=np.tile(COLOURS[0].astype(np.uint8), (len(azimuths), 1)),
        lod="off",
        opacity=0.9,
        side="double",
        cast_shadow=False,
        receive_shadow=False,
        wxyz=hub,
        position=rotor.hub,
    )
