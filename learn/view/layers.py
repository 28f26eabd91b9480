"""The 3D view of a tab, and checkboxes of its layers: spectra on a hemisphere, primitives, traced paths, positions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from jaxtyping import Float, UInt8, UInt32
from scipy.spatial.transform import Rotation
from viser import BatchedMeshHandle, ClientHandle, PointCloudHandle

from learn.models.networks.bisplat import Splats
from learn.reports.plots import PHASE
from learn.view.chart import LINEAR, Colours, colour_of
from learn.view.compared_spectra import PREDICTED, TRUE
from learn.view.room_layers import TRANSMITTER, add_room, add_transmitter, add_uses, switch
from learn.view.subject import Position, SpectrumArray, Subject
from scenes.browser.scene_view import GATEWAY, add_gateway, add_region, set_up
from scenes.browser.served_page import shield
from scenes.scene.shapes import bounding_box
from simulate.spectra.angular_grid import COLUMNS, ROWS, AngularGrid, direction

if TYPE_CHECKING:
    from simulate.rays.core.multipath import TracedPath


PATHS_SHOWN = 40  # Largest number of traced paths that are drawn, the strongest ones

PATH_COLOURS = Colours("plasma", -30.0, 0.0, " dB")
"""Colours of traced paths by their gain relative to the strongest path, dB."""


class Layers:
    """The objects of the 3D view, and the checkboxes that hide them."""

    def __init__(self, client: ClientHandle, subject: Subject, position: Position, changed: Callable[[], None]):
        self._subject, self._client = subject, client
        api = client.scene
        gateway = np.asarray(subject.gateway.position)
        scene_bounds = [] if subject.scene is None else [subject.scene.bounds]
        bounds = bounding_box(np.vstack([subject.region, gateway, *scene_bounds]))
        self._size = float(np.linalg.norm(bounds[1] - bounds[0]))
        self._radius = 0.09 * self._size
        set_up(client, bounds)
        rooms, furniture = add_room(client, subject.scene)
        self._gateway = add_gateway(api, subject.gateway, subject.wavelength, 0.8 * self._radius)
        if subject.array_moves:
            api.add_icosphere("/standing", radius=0.008 * self._size, color=TRANSMITTER, position=tuple(gateway))
        elements = (subject.beamformer.array.positions * subject.wavelength).astype(np.float32)
        api.add_point_cloud("/gateway/elements", elements, (60, 0, 20), point_size=0.003 * self._size)
        region = add_region(api, subject.region)

        self._dots, self._pixel = dots(self._radius, subject.beamformer.grid)
        black = np.zeros((len(self._dots), 3), np.uint8)
        dot_size = self._radius * np.radians(DOT_DEG)
        style = {"point_size": float(dot_size), "point_shape": "circle", "point_shading": "flat"}
        self._sphere = api.add_point_cloud("/gateway/spectrum", self._dots, black, **style)  # type: ignore[arg-type]
        point = np.zeros((1, 2, 3), np.float32)
        self._predicted = api.add_line_segments(
            "/gateway/predicted", point, PREDICTED, thickness=5, thickness_units="screen"
        )
        self._true = api.add_line_segments("/gateway/true", point, TRUE, thickness=5, thickness_units="screen")
        self._paths = api.add_line_segments(
            "/paths", point, np.zeros((1, 2, 3), np.uint8), thickness=2, thickness_units="screen"
        )
        self._splats: BatchedMeshHandle | None = None

        known, self._tested = self._positions(client)
        colour = GATEWAY if subject.array_moves else TRANSMITTER
        self.transmitter = add_transmitter(client, position, self._size, colour)
        with client.gui.add_folder("Layers"):
            self._on_sphere = client.gui.add_dropdown("hemisphere shows", ("predicted", "recorded or traced"))
            switch(client, "walls, floor, ceiling", rooms)
            switch(client, "furniture", furniture)
            switch(client, "receiver region" if subject.array_moves else "transmitter region", [region])
            switch(client, "training positions", known)
            switch(client, "test positions, by SSIM (yellow: 1)", self._tested)
            switch(client, "spectrum on the hemisphere", [self._sphere])
            switch(client, "dominant directions", [self._predicted, self._true])
            switch(client, "traced paths", [self._paths] if subject.scene and not subject.array_moves else [])
            add_uses(client, subject, self._size)
            visible = subject.has_primitives
            self._primitives = client.gui.add_checkbox("primitives (colour: phase)", False, visible=visible)
        self._primitives.on_update(shield(client, lambda event: changed()))
        self._on_sphere.on_update(shield(client, lambda event: self._colour_sphere()))
        self._spectra: tuple[SpectrumArray | None, SpectrumArray | None] = None, None

    def show(
        self,
        position: Position,
        predicted: SpectrumArray | None,
        true: SpectrumArray | None,
        paths: Sequence[TracedPath] | None,
    ) -> None:
        """Draw everything that depends on the transmitter's position."""
        self._spectra = predicted, true
        self._colour_sphere()
        if self._subject.array_moves:
            self._gateway.position = position
        for node, spectrum in ((self._predicted, predicted), (self._true, true)):
            node.points = self._ray(spectrum)
        with self._client.atomic():  # the browser must always see as many colours as points
            self._paths.points, self._paths.colors = self._lines(paths or [])
        self._show_primitives(position)

    def _show_primitives(self, position: Position) -> None:
        if self._primitives.value:
            drawn = ellipses(self._subject.splats(position), 1.02 * self._radius)
            with self._client.atomic():
                self._splats = self._client.scene.add_batched_meshes_simple(
                    "/gateway/primitives",
                    *disc(),
                    batched_wxyzs=drawn.turns,
                    batched_positions=drawn.centres,
                    batched_scales=drawn.stretches,
                    batched_colors=drawn.colours,
                    batched_opacities=drawn.opacities,
                    side="double",
                    lod="off",
                    cast_shadow=False,
                    receive_shadow=False,
                )
        elif self._splats is not None:
            self._splats.visible = False

    def _colour_sphere(self) -> None:
        predicted, true = self._spectra
        chosen = predicted if self._on_sphere.value == "predicted" else true
        spectrum = chosen if chosen is not None else true if true is not None else predicted
        if spectrum is not None:
            self._sphere.colors = colour_of(spectrum[self._pixel], LINEAR)  # RGB of each dot

    def _ray(self, spectrum: SpectrumArray | None) -> Float[np.ndarray, "1 2 3"]:
        """A line from the hemisphere towards a spectrum's maximum; a line of length 0 if there is no spectrum."""
        if spectrum is None:
            return np.zeros((1, 2, 3), np.float32)
        towards = self._subject.beamformer.grid.dominant_direction(spectrum)
        return np.array([[self._radius * towards, 0.5 * self._size * towards]], np.float32)

    def _lines(self, paths: Sequence[TracedPath]) -> tuple[np.ndarray, np.ndarray]:
        """Segments of the strongest paths, metres, and the colours of their ends."""
        segments, colours = [np.zeros((1, 2, 3))], [np.zeros((1, 2, 3), np.uint8)]  # viser does not accept empty arrays
        for path in list(paths)[:PATHS_SHOWN]:
            segments.append(np.stack([path.vertices[:-1], path.vertices[1:]], axis=1))
            gain = 20 * np.log10(abs(path.response) / abs(paths[0].response))
            colour = colour_of(np.array(gain), PATH_COLOURS)
            colours.append(np.broadcast_to(colour, (len(path.vertices) - 1, 2, 3)))
        return np.concatenate(segments).astype(np.float32), np.concatenate(colours)

    def _positions(self, client: ClientHandle) -> tuple[list[PointCloudHandle], list[PointCloudHandle]]:
        """Draw the dataset's known and test positions; the latter are grey until their scores are computed."""
        subject, api = self._subject, client.scene
        if subject.dataset is None or subject.parts is None:
            return [], []
        dot_size = 0.004 * self._size
        known = subject.dataset.positions[subject.parts.known].astype(np.float32)
        tested = subject.dataset.positions[subject.tested].astype(np.float32)
        grey = np.full(tested.shape, 170, np.uint8)
        style = {"point_size": dot_size, "point_shape": "circle"}
        test_style = {**style, "point_size": 1.5 * dot_size}
        return (
            [api.add_point_cloud("/positions/training", known, (110, 110, 130), **style)],  # type: ignore[arg-type]
            [api.add_point_cloud("/positions/test", tested, grey, **test_style)],  # type: ignore[arg-type]
        )

    def colour_test_positions(self) -> None:
        """Colour the test positions by their SSIM; the first call computes the scores, which takes seconds."""
        for node in self._tested:
            if len(self._subject.scores):
                node.colors = colour_of(self._subject.scores, LINEAR)


EVERY_DEG = 2  # Angle between neighbouring dots of a spectrum, degrees

DOT_DEG = 0.8 * EVERY_DEG
"""Radius of a dot as seen from the middle, degrees. Dots overlap: what shows between them would make a moiré."""

RADIANS = Colours(PHASE, -np.pi, np.pi, "")


def dots(radius: float, grid: AngularGrid) -> tuple[Float[np.ndarray, "dots 3"], tuple[np.ndarray, np.ndarray]]:
    """Dots spread evenly over the hemisphere, which cover it if their radius is ``DOT_DEG``."""
    rows, columns = [], []
    for row in sorted({*range(0, ROWS, EVERY_DEG), ROWS - 1}):  # the last, so that no hole is left around boresight
        count = max(1, round(COLUMNS / EVERY_DEG * np.cos(np.radians(grid.elevations_deg[row]))))
        columns.append(np.round(np.arange(count) * COLUMNS / count).astype(int))
        rows.append(np.full(count, row))
    pixel = np.concatenate(rows), np.concatenate(columns)
    return radius * grid.directions[pixel], pixel


class Ellipses(NamedTuple):
    """N_p ellipses on the hemisphere, whose semi-axes are one standard deviation of a primitive.

    Each is a disc of radius 1 in the x–y plane that is stretched first, then turned, then moved.
    """

    centres: Float[np.ndarray, "N_p 3"]  # positions on the hemisphere, metres, gateway frame
    turns: Float[np.ndarray, "N_p 4"]  # rotations as quaternions (w, x, y, z), which is viser's order
    stretches: Float[np.ndarray, "N_p 3"]  # semi-axes along the disc's x and y, metres, and 1 along z
    # RGB; the hue is the phase of the primitive's coefficient, and the brightness is its magnitude divided by the
    # largest magnitude
    colours: UInt8[np.ndarray, "N_p 3"]
    opacities: Float[np.ndarray, " N_p"]  # opacity divided by the largest opacity, 0…1


def ellipses(splats: Splats, radius: float) -> Ellipses:
    """A model's primitives as ellipses on the hemisphere."""
    azimuth, elevation = (np.radians(axis.double().numpy()) for axis in (splats.azimuth, splats.elevation))
    scale, rotation, opacity, real_imaginary = (each[0].double().numpy() for each in splats[3:])
    towards = direction(azimuth, elevation)
    east = np.stack([-np.sin(azimuth), np.cos(azimuth), np.zeros_like(azimuth)], axis=-1)
    north = np.cross(towards, east)
    # On the sphere, a degree of azimuth is shorter than a degree of elevation by the factor cos θ.
    cosine, sine, azimuth_factor = np.cos(rotation), np.sin(rotation), np.cos(elevation)
    # East and north components of the two axes along which the Gaussian has its standard deviations.
    axis_directions = np.array([[azimuth_factor * cosine, -azimuth_factor * sine], [sine, cosine]])
    axes = radius * np.radians(scale)[:, None] * axis_directions.transpose(2, 0, 1)
    semi_axis_directions, lengths, _ = np.linalg.svd(axes)  # of the ellipse on the sphere
    first = semi_axis_directions[:, 0, 0, None] * east + semi_axis_directions[:, 1, 0, None] * north
    turns = Rotation.from_matrix(np.stack([first, np.cross(towards, first), towards], axis=-1)).as_quat()
    coefficient = real_imaginary[:, 0] + 1j * real_imaginary[:, 1]
    magnitude = np.abs(coefficient) / max(np.abs(coefficient).max(), 1e-12)
    colours = (colour_of(np.angle(coefficient), RADIANS) * (0.2 + 0.8 * magnitude[:, None])).astype(np.uint8)
    stretches = np.concatenate([lengths, np.ones((len(lengths), 1))], axis=1)
    return Ellipses(
        (radius * towards).astype(np.float32),
        np.roll(turns, 1, axis=1).astype(np.float32),
        stretches.astype(np.float32),
        colours,
        (opacity / opacity.max()).astype(np.float32),
    )


def disc() -> tuple[Float[np.ndarray, "vertices 3"], UInt32[np.ndarray, "faces 3"]]:
    """Vertices and triangles of a disc of radius 1 in the x–y plane."""
    corners = 24
    angle = 2 * np.pi * np.arange(corners) / corners
    rim = np.stack([np.cos(angle), np.sin(angle), np.zeros(corners)], axis=-1)
    index = np.arange(corners)
    faces = np.stack([np.full(corners, corners), index, (index + 1) % corners], axis=-1)
    return np.concatenate([rim, np.zeros((1, 3))]).astype(np.float32), faces.astype(np.uint32)
