"""What is shown, how large, and from where."""

from typing import Any

from viser import ViserServer

from sbs_sim.cockpit.scene import Shown

MAX_MAGNIFICATION = 20.0
# In the viewer's axes, north, west, up, for an aircraft of the reference size of the scene [m].
CAMERAS = {"behind": (-2.0, 1.2, 1.0), "left": (0.0, 2.6, 0.3), "above": (-0.01, 0.0, 3.0), "front": (2.2, 0.7, 0.6)}
FIRST = "behind"
NARROW = 0.9  # width over height of a picture; from further away a narrower one holds the whole aircraft, too


class Viewpoint:
    """Cameras of all clients, at a distance that goes with the size of the aircraft.

    Parameters
    ----------
    server : ViserServer
    """

    def __init__(self, server: ViserServer) -> None:
        self._server, self._scale = server, 1.0
        self._set_first()
        server.on_client_connect(lambda client: self.set_camera(client, FIRST))

    def _set_first(self) -> None:
        camera = self._server.initial_camera
        camera.position = tuple(self._scale * part for part in CAMERAS[FIRST])
        camera.look_at = (0.0, 0.0, 0.0)

    def use(self, scale: float) -> None:
        """Keep the view of an aircraft of another size."""
        ratio, self._scale = scale / self._scale, scale
        self._set_first()
        if ratio != 1.0:
            for client in self._server.get_clients().values():
                position, look_at = ratio * client.camera.position, ratio * client.camera.look_at
                client.camera.position = position
                client.camera.look_at = look_at  # last: a camera that is moved goes on to look the same way

    def set_camera(self, client: Any, name: str) -> None:
        """Look at the aircraft from one of the CAMERAS."""
        if client is not None and name in CAMERAS:
            aspect = client.camera.aspect  # of whoever connects: it may be anything
            distance = self._scale * (max(1.0, NARROW / aspect) if 0.1 < aspect < 10.0 else 1.0)
            client.camera.position = tuple(distance * part for part in CAMERAS[name])
            client.camera.look_at = (0.0, 0.0, 0.0)


class ViewPanel:
    """What is shown, how large, from where.

    Parameters
    ----------
    server : ViserServer
    shown : Shown
        Changed in place.
    viewpoint : Viewpoint
    """

    def __init__(self, server: ViserServer, shown: Shown, viewpoint: Viewpoint) -> None:
        gui = server.gui
        magnification = gui.add_slider(
            "Flap, lag ×",
            1.0,
            MAX_MAGNIFICATION,
            0.5,
            shown.magnification,
            hint="factor by which flap and lag angles are magnified",
        )
        magnification.on_update(lambda _: _magnify(shown, magnification.value))
        for field, label in (
            ("ducts", "Ducts"),
            ("paths", "Tip paths"),
            ("arrows", "Thrust and hub moments"),
            ("inflow", "Inflow"),
            ("trail", "Trail"),
        ):
            box = gui.add_checkbox(label, getattr(shown, field))
            box.on_update(lambda _, field=field, box=box: setattr(shown, field, box.value))
        cameras = gui.add_button_group("From", tuple(CAMERAS))
        cameras.on_click(lambda event: viewpoint.set_camera(event.client, event.target.value))


def _magnify(shown: Shown, value: float) -> None:
    if 1.0 <= value <= MAX_MAGNIFICATION:  # false for a NaN as well
        shown.magnification = value
