"""Move the gateway and the transmitter region of a scene in the browser, and copy the lines that put them there.

Nothing is written, and spectra on the page stay those of the scene that was opened.
"""

from __future__ import annotations

from functools import partial

import numpy as np
from jaxtyping import Float
from viser import ClientHandle, TransformControlsEvent

from scenes.browser.scene_view import add_gateway, add_region, wxyz, xyzw
from scenes.browser.served_page import shield
from scenes.drawing.perspective import box_edges
from scenes.files.lengths import rounded
from scenes.scene.description import Scene
from scenes.scene.orientation import Quaternion, boresight_of


class MovedAntennas:
    """Handles at the gateway and at two corners of the region, and the lines for what they stand for."""

    def __init__(self, client: ClientHandle, scene: Scene):
        gateway, api, gui = scene.gateway, client.scene, client.gui
        self._position, self._orientation = np.array(gateway.position, float), gateway.orientation
        self._region = scene.transmitter.region.astype(float)
        size = float(np.linalg.norm(scene.bounds[1] - scene.bounds[0]))
        self._gateway = add_gateway(api, gateway, scene.wavelength, 0.06 * size, "/moved/gateway")
        self._box = add_region(api, self._region, "/moved/region")
        turned = api.add_transform_controls(
            "/handles/gateway",
            scale=0.12 * size,
            depth_test=False,
            position=gateway.position,
            wxyz=wxyz(gateway.orientation),
        )
        turned.on_update(shield(client, self._move_gateway))
        nodes = [self._gateway, self._box, turned]
        for index, corner in enumerate(("min", "max")):
            handle = api.add_transform_controls(
                f"/handles/{corner}",
                scale=0.06 * size,
                depth_test=False,
                disable_rotations=True,
                position=tuple(self._region[index]),
            )
            handle.on_update(shield(client, partial(self._move_corner, index)))
            nodes.append(handle)
        for node in nodes:
            node.visible = False
        with gui.add_folder("Move gateway and region"):
            shows = gui.add_checkbox("show the handles", False, hint="drag their arrows; the gateway's rings turn it")
            self._lines = gui.add_markdown("")

        @shows.on_update
        def _(event) -> None:
            for node in nodes:
                node.visible = shows.value

        self._write()

    async def _move_gateway(self, event: TransformControlsEvent) -> None:
        self._position, self._orientation = np.array(event.target.position, float), xyzw(event.target.wxyz)
        self._gateway.position, self._gateway.wxyz = event.target.position, event.target.wxyz
        self._write()

    async def _move_corner(self, index: int, event: TransformControlsEvent) -> None:
        self._region[index] = event.target.position
        self._box.points = box_edges(self._region)
        self._write()

    def _write(self) -> None:
        in_file, in_command = lines(self._position, self._orientation, self._region)
        self._lines.content = f"In scene.yaml:\n\n```\n{in_file}\n```\n\nFor an import:\n\n```\n{in_command}\n```"


def lines(
    position: Float[np.ndarray, " 3"], orientation: Quaternion, region: Float[np.ndarray, "2 3"]
) -> tuple[str, str]:
    """Lines of a scene.yaml, and options of ``bisplat scene``, for a gateway's pose and a region."""
    low, high = region.min(axis=0), region.max(axis=0)
    in_file = (
        f"gateway:\n  position: {rounded(position)}\n  orientation: {rounded(orientation, 6)}\n"
        f"transmitter:\n  region:\n    min: {rounded(low)}\n    max: {rounded(high)}"
    )
    options = {"gateway": position, "boresight": boresight_of(orientation), "region-min": low, "region-max": high}
    words = [f"--{name} {' '.join(map(str, rounded(values)))}" for name, values in options.items()]
    return in_file, "bisplat scene FILE -o FOLDER \\\n    " + " \\\n    ".join(words)
