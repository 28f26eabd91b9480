"""``bisplat scene --view``: move and turn the gateway, move the region's corners, assign materials, save the scene.

Each tab edits its own scene, ``Editor.scene``. The scene is written only when the user presses the button.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from threading import Lock
from typing import Any

import numpy as np
from viser import ClientHandle, SceneNodeHandle, TransformControlsEvent, TransformControlsHandle

from scenes.browser.callbacks import shield
from scenes.browser.scene_view import add_gateway, add_objects, add_region, edges, set_up, wxyz, xyzw
from scenes.files.errors import InputError, printable
from scenes.scene.description import Scene
from scenes.scene.materials import material_names, p2040_material
from scenes.scene.orientation import facing
from scenes.storage.scene_writing import FilesInTheWay, digest, write_scene, yaml_of

Triple = tuple[float, float, float]
CHOSEN = (255, 140, 0)
"""Colour of the selected object, RGB, 0 to 255."""

SHOWN_FILES = 3
"""Most files that a notification names."""


class Editor:
    """A browser tab that edits a scene."""

    def __init__(self, client: ClientHandle, scene: Scene, folder: Path):
        self.scene = scene
        self._client, self._holding = client, False
        self._shield = partial(shield, client)
        api, gui = client.scene, client.gui
        set_up(client, scene.bounds)
        self._size = float(np.linalg.norm(scene.bounds[1] - scene.bounds[0]))
        self._objects = add_objects(api, scene)
        for name, gateway in scene.further_gateways.items():
            add_gateway(api, gateway, scene.wavelength, 0.06 * self._size, f"/further/{name}")
        gui.add_markdown(
            "Drag the arrows and rings of the gateway, and the arrows at two corners of the region. Click an object in "
            "the room to select it, then choose its material. Select walls, floor and ceiling by name: they do not "
            "react to clicks."
        )
        self._edit_gateway()
        self._edit_region()
        self._edit_materials()
        for label, group in (("walls, floor, ceiling", "/walls/"), ("furniture", "/furniture/")):
            self._switch(
                label, [node for nodes in self._objects.values() for node in nodes if node.name.startswith(group)]
            )
        self._folder, self._saving = folder, Lock()
        self._replaceable: dict[Path, str] = {}  # files that this tab has written, with their digests
        self._in_the_way: Mapping[Path, str] = {}  # files that the user was asked about
        gui.add_text("saved to folder", printable(str(folder.absolute())), disabled=True)
        save_button = gui.add_button("Save scene.yaml")
        self._replace_button = gui.add_button("Replace", color="red", visible=False)  # before a click can come
        save_button.on_click(self._shield(lambda event: self.save()))
        self._replace_button.on_click(self._shield(lambda event: self.save(self._in_the_way)))

    def save(self, replaceable: Mapping[Path, str] | None = None) -> None:
        """Write the scene to the folder. Ask the user first if this replaces files that this tab did not write."""
        with self._saving:
            scene = self.scene
            self._replace_button.visible = False
            try:
                path = write_scene(scene, self._folder, {**self._replaceable, **(replaceable or {})})
            except FilesInTheWay as found:
                self._ask(found.digests)
                return
            self._replaceable[path] = digest(yaml_of(scene))
            self._client.add_notification("Saved", printable(str(path)), color="green")

    def _ask(self, in_the_way: Mapping[Path, str]) -> None:
        self._in_the_way = in_the_way
        count = len(in_the_way)
        self._replace_button.label = f"Replace {count} {'file' if count == 1 else 'files'}"
        self._replace_button.visible = True
        names = [printable(str(path.relative_to(self._folder))) for path in in_the_way]
        more = f" and {count - SHOWN_FILES} more" if count > SHOWN_FILES else ""
        self._client.add_notification(
            "Not saved yet",
            f"The folder already contains {', '.join(names[:SHOWN_FILES])}{more}, not written by this tab. "
            f'Press "{self._replace_button.label}" to overwrite.',
            color="orange",
        )

    # --- gateway -------------------------------------------------------------------------------------------

    def _edit_gateway(self) -> None:
        gateway, api, gui = self.scene.gateway, self._client.scene, self._client.gui
        handle = api.add_transform_controls(
            "/handles/gateway",
            scale=0.12 * self._size,
            depth_test=False,
            position=gateway.position,
            wxyz=wxyz(gateway.orientation),
        )
        frame = add_gateway(api, gateway, self.scene.wavelength, 0.06 * self._size)
        with gui.add_folder("Gateway"):
            position = gui.add_vector3("position (m)", gateway.position, step=0.01)
            boresight = gui.add_vector3(
                "boresight", _boresight(self.scene), step=0.01, hint="the y axis of the array points up"
            )

        @handle.on_update
        @self._shield
        async def _(event) -> None:
            if not self._held(event):
                return
            x, y, z = (round(float(c), 4) for c in event.target.position)
            self._replace_gateway(position=(x, y, z), orientation=xyzw(event.target.wxyz))
            frame.position, frame.wxyz = (x, y, z), event.target.wxyz
            position.value, boresight.value = (x, y, z), _boresight(self.scene)  # type: ignore[misc]

        # Typing moves the handle, but changes no other field: the user may be editing it.
        @position.on_update
        @self._shield
        async def _(event) -> None:
            if event.client is not None:  # typed by the user, not set by this program
                self._replace_gateway(position=position.value)
                handle.position = frame.position = position.value

        @boresight.on_update
        @self._shield
        async def _(event) -> None:
            if event.client is not None and any(boresight.value):
                self._replace_gateway(orientation=facing(boresight.value))
                handle.wxyz = frame.wxyz = wxyz(self.scene.gateway.orientation)

    def _held(self, event: TransformControlsEvent) -> bool:
        """Whether the user is dragging the handle. A handle that moves because of typing also sends events."""
        if event.phase == "start":
            self._holding = True
        held = self._holding
        if event.phase == "end":
            self._holding = False
        return held

    def _replace_gateway(self, **changes) -> None:
        self.scene = replace(self.scene, gateway=replace(self.scene.gateway, **changes))

    # --- transmitter region --------------------------------------------------------------------------------

    def _edit_region(self) -> None:
        transmitter, api, gui = self.scene.transmitter, self._client.scene, self._client.gui
        box = add_region(api, transmitter.region)
        with gui.add_folder("Transmitter region"):
            for name in ("region_min", "region_max"):
                corner = getattr(transmitter, name)
                handle = api.add_transform_controls(
                    f"/handles/{name}",
                    scale=0.06 * self._size,
                    depth_test=False,
                    disable_rotations=True,
                    position=corner,
                )
                typed = gui.add_vector3(f"{name[-3:]} (m)", corner, step=0.01)
                self._edit_corner(name, handle, typed, box)

    def _edit_corner(self, name: str, handle: TransformControlsHandle, typed, box) -> None:
        def move(corner: Triple) -> None:
            changed: dict[str, Any] = {name: corner}
            transmitter = replace(self.scene.transmitter, **changed)
            self.scene = replace(self.scene, transmitter=transmitter)
            box.points = edges(transmitter.region)

        @handle.on_update
        @self._shield
        async def _(event) -> None:
            if self._held(event):
                x, y, z = (round(float(c), 4) for c in event.target.position)
                move((x, y, z))
                typed.value = (x, y, z)

        @typed.on_update
        @self._shield
        async def _(event) -> None:
            if event.client is not None:
                move(typed.value)
                handle.position = typed.value

    # --- materials -----------------------------------------------------------------------------------------

    def _edit_materials(self) -> None:
        gui, scene = self._client.gui, self.scene
        names = [item.name for item in scene.objects]
        known = sorted({*scene.materials, *material_names()})
        with gui.add_folder("Materials"):
            which = gui.add_dropdown("object", tuple(names))
            material = gui.add_dropdown("material", tuple(known), initial_value=scene.objects[0].material)

        def choose(name: str) -> None:
            which.value = name  # type: ignore[misc]
            item = next(item for item in self.scene.objects if item.name == name)
            material.value = item.material  # type: ignore[misc]
            for other in self.scene.objects:
                self._colour(other.name, CHOSEN if other.name == name else None)

        for name, nodes in self._objects.items():
            for node in nodes:
                if node.name.startswith("/furniture/"):
                    node.on_click(self._shield(lambda event, name=name: choose(name)))  # type: ignore[attr-defined]

        @which.on_update
        @self._shield
        def _(event) -> None:
            if event.client is not None:
                choose(which.value)

        @material.on_update
        @self._shield
        def _(event) -> None:
            if event.client is None:
                return
            try:
                self.assign(which.value, material.value)
            except InputError as error:
                self._client.add_notification("Material not available", str(error), color="red")
                choose(which.value)
                return
            self._colour(which.value)

    def assign(self, name: str, material: str) -> None:
        """Assign a material of the scene or of ITU-R P.2040 to an object."""
        scene = self.scene
        materials = dict(scene.materials)
        if material not in materials:
            materials[material] = p2040_material(material, scene.frequency)
        objects = tuple(replace(item, material=material) if item.name == name else item for item in scene.objects)
        self.scene = replace(scene, objects=objects, materials=materials)

    def _colour(self, name: str, colour: tuple[int, int, int] | None = None) -> None:
        item = next(item for item in self.scene.objects if item.name == name)
        own = tuple(round(255 * c) for c in self.scene.materials[item.material].color)
        for node in self._objects[name]:
            node.color = colour or own  # type: ignore[attr-defined]

    def _switch(self, label: str, nodes: list[SceneNodeHandle]) -> None:
        box = self._client.gui.add_checkbox(label, True)

        @box.on_update
        @self._shield
        def _(event) -> None:
            for node in nodes:
                node.visible = box.value


def _boresight(scene: Scene) -> Triple:
    x, y, z = scene.gateway.boresight.round(4) + 0.0
    return float(x), float(y), float(z)
