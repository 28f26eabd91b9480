"""The picture shows what is there, and the description is plain data."""

import json
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.image import imread
from matplotlib.patches import Rectangle
from trimesh import Trimesh

from scenes.checks.enclosure import ceiling_height
from scenes.drawing import perspective, scene_drawing
from scenes.drawing.doors import closed_leaves
from scenes.drawing.floor_plan import DOOR, draw_plan, section
from scenes.drawing.perspective import draw_view
from scenes.drawing.scene_drawing import DrawingError, describe_scene, draw_scene
from scenes.files.errors import InputError
from scenes.scene.antennas import Transmitter
from scenes.scene.description import SceneObject
from scenes.scene.materials import p2040_material
from scenes.scene.shapes import box, rotate, sheet, union
from scenes.storage.scene_yaml import load_scene


@pytest.fixture(autouse=True)
def little_memory(monkeypatch):
    """Fewer pairs of triangles and pixels at once, which changes no picture."""
    monkeypatch.setattr(perspective, "PAIRS", 400_000)


def share(image, color):
    """Share of the picture in this hue, however it is shaded."""
    pixels = image[..., :3] / np.linalg.norm(image[..., :3], axis=-1, keepdims=True).clip(1e-6)
    return np.mean(pixels @ (np.array(color) / np.linalg.norm(color)) > 0.9995)


def test_one_can_look_in(scene, tmp_path):
    """The ceiling and the near walls are left out, whether the room is one mesh or many."""
    materials = {name: p2040_material(name, 915e6) for name in ("brick", "marble", "metal", "wood")}
    crate = SceneObject("crate", box((-3, -3, 0.1), (-1, -1, 1)), "wood")
    sheets = (
        SceneObject("floor", sheet((-5, -5, 0), (10, 0, 0), (0, 10, 0)), "marble"),
        SceneObject("ceiling", sheet((-5, -5, 3), (10, 0, 0), (0, 10, 0)), "metal"),
        SceneObject("near", sheet((-5, -5, 0), (10, 0, 0), (0, 0, 3)), "brick"),
    )
    draw_scene(replace(scene, objects=(*sheets, crate), materials=materials), tmp_path / "many.png")
    image = imread(tmp_path / "many.png")
    assert share(image, materials["metal"].color) < 0.01 and share(image, materials["brick"].color) < 0.01

    shell = SceneObject("room", box((-5, -5, -0.01), (5, 5, 3)), "brick")
    draw_scene(replace(scene, objects=(shell, crate), materials=materials), tmp_path / "one.png")
    for file in ("many.png", "one.png"):
        assert share(imread(tmp_path / file), materials["wood"].color) > 0.003


def street(scene, region_min, region_max):
    """A brick building with a metal roof on a square; the viewer sees its south and west sides."""
    building = union(*(sheet((-2, y, 0), (4, 0, 0), (0, 0, 3)) for y in (-2, 2)))
    sides = union(*(sheet((x, -2, 0), (0, 4, 0), (0, 0, 3)) for x in (-2, 2)))
    objects = (
        SceneObject("ground", sheet((-10, -10, 0), (20, 0, 0), (0, 20, 0)), "concrete"),
        SceneObject("front and back", building, "brick"),
        SceneObject("sides", sides, "brick"),
        SceneObject("roof", sheet((-2, -2, 3), (4, 0, 0), (0, 4, 0)), "metal"),
    )
    materials = {name: p2040_material(name, 915e6) for name in ("brick", "concrete", "metal")}
    return replace(scene, objects=objects, materials=materials, transmitter=Transmitter(region_min, region_max))


def test_only_what_covers_gateway_and_region_is_a_ceiling(scene):
    triangles = np.concatenate([item.mesh.triangles for item in load_scene("lab").objects])
    assert ceiling_height(load_scene("lab"), triangles) == pytest.approx(3)
    place = street(scene, (-1, -1, 0.5), (1, 1, 1.5))  # the region is in the building, the gateway is not
    assert ceiling_height(place, np.concatenate([item.mesh.triangles for item in place.objects])) == np.inf


def view_of(place):
    figure = Figure(figsize=(7, 7), dpi=110, layout="constrained")
    axes = figure.add_subplot(projection="3d")
    draw_view(axes, place)
    figure.draw_without_rendering()
    return figure, axes


def green_lines(place):
    """Line styles of the edges of the region."""
    return {line.get_linestyle() for line in view_of(place)[1].lines if line.get_color() == "green"}


def test_what_a_building_hides_of_the_region_is_dashed(scene):
    assert green_lines(street(scene, (-8, -8, 0.5), (-6, -6, 1.5))) == {"-"}  # before it
    assert green_lines(street(scene, (2.5, 2.1, 0.1), (3, 3, 0.3))) == {"--"}  # behind it
    assert green_lines(street(scene, (-1, -4, 0.5), (1, 0, 1.5))) == {"-", "--"}  # reaches into it


def test_plan_shows_furniture_of_a_room_that_is_one_mesh(scene):
    """A section at 1 m, the height of the region: walls and wardrobe; the table below it by its outline."""
    walls = [box((-5, y, 0), (5, y + 0.1, 3)) for y in (-5, 4.9)]
    wardrobe, table = rotate(box((-4, 2, 0), (-2, 3, 2)), 30), rotate(box((2, 2, 0.7), (4, 3, 0.8)), 20)
    room = union(box((-5, -5, -0.1), (5, 5, -0.01)), *walls, wardrobe, table)
    axes = Figure().add_subplot()
    draw_plan(axes, replace(scene, objects=(SceneObject("room", room, "wood"),)))
    (lines,) = (each for each in axes.collections if isinstance(each, LineCollection))
    ends = np.concatenate(lines.get_segments())
    for solid in (*walls, wardrobe):
        assert all(np.linalg.norm(ends - corner, axis=1).min() < 1e-6 for corner in solid.vertices[:, :2])
    (seen,) = (each for each in axes.collections if not isinstance(each, LineCollection))
    outlines = [path.vertices for path in seen.get_paths() if (path.vertices[1] == path.vertices[2]).all()]
    assert all(
        np.linalg.norm(np.concatenate(outlines) - corner, axis=1).min() < 1e-6 for corner in table.vertices[:, :2]
    )
    assert sum(isinstance(each, Rectangle) for each in axes.patches) == 1  # the region alone


def alone(scene, *meshes):
    """A scene of these meshes only, whose antennas are near the origin, 0.5 to 1.5 m high."""
    return replace(scene, objects=tuple(SceneObject(f"{n}", mesh, "wood") for n, mesh in enumerate(meshes)))


CORNERS = [(x, y) for x in (-120, 60) for y in (-120, 60)]


@pytest.mark.parametrize(
    "meshes",
    [
        [sheet((-5, -5, 6), (10, 0, 0), (0, 10, 0))],
        [box((x, y, 0), (x + 60, y + 60, 20)) for x, y in CORNERS],
        [sheet((-5, -5, -20), (10, 0, 0), (0, 10, 0))],
    ],
    ids=["a roof alone", "houses about a square", "far below"],
)
def test_a_scene_of_which_nothing_is_near_the_antennas_is_drawn(scene, meshes, tmp_path):
    place = alone(scene, *meshes)
    draw_scene(place, tmp_path / "scene.png")
    plan, view = np.split(imread(tmp_path / "scene.png"), 2, axis=1)
    color = place.materials["wood"].color
    assert share(plan, color) > 1e-4 and share(view, color) > 1e-4


def test_the_drawing_says_what_it_leaves_out(scene):
    lab = load_scene("lab")
    axes = Figure().add_subplot(projection="3d")
    ceiling, walls = draw_view(axes, lab)
    assert "2.95 m" in ceiling and walls.startswith("2 walls")
    assert "section at z = 1.25 m" in draw_plan(Figure().add_subplot(), lab)[1]
    assert draw_view(axes, street(scene, (-8, -8, 0.5), (-6, -6, 1.5))) == []
    assert draw_view(axes, alone(scene, *(box((x, y, 0), (x + 60, y + 60, 20)) for x, y in CORNERS))) == []
    (beyond,) = draw_view(axes, alone(scene, sheet((-500, -500, 0), (1000, 0, 0), (0, 1000, 0))))
    assert "8 m" in beyond


def house(scene, *doors):
    """A room of 6 × 6 m with a ceiling. Its east wall, 20 cm thick, has a doorway from y = 0 to y = 1, 2.1 m high."""
    shell = [sheet((-3, -3, z), (6, 0, 0), (0, 6, 0)) for z in (0, 3)]
    shell += [sheet((-3, y, 0), (6, 0, 0), (0, 0, 3)) for y in (-3, 3)] + [sheet((-3, -3, 0), (0, 6, 0), (0, 0, 3))]
    outline = [(-3, 0), (0, 0), (0, 2.1), (1, 2.1), (1, 0), (3, 0), (3, 3), (-3, 3)]
    front = np.array([(0, 1, 7), (1, 2, 7), (2, 3, 7), (3, 6, 7), (3, 4, 5), (3, 5, 6)])
    sides = [face for n in range(8) for m in [(n + 1) % 8] for face in ((n, m, m + 8), (n, m + 8, n + 8))]
    corners = [(x, y, z) for x in (3, 3.2) for y, z in outline]
    wall = Trimesh(corners, np.concatenate([front, front + 8, sides]), process=False)
    objects = [SceneObject(f"shell {n}", mesh, "concrete") for n, mesh in enumerate(shell)]
    objects += [SceneObject("wall", wall, "brick")] + [SceneObject("Door", mesh, "wood") for mesh in doors]
    materials = {name: p2040_material(name, 915e6) for name in ("brick", "concrete", "wood")}
    return replace(
        scene,
        objects=tuple(objects),
        materials=materials,
        gateway=replace(scene.gateway, position=(-2.0, 0.0, 1.0)),
        transmitter=Transmitter((-1, -1, 0.5), (0, 1, 1.5)),
    )


def plan_of(place):
    figure = Figure(figsize=(6, 6), dpi=100)
    axes = figure.add_axes((0, 0, 1, 1))
    draw_plan(axes, place)
    axes.set(xlim=(-3.5, 4.5), ylim=(-4, 4))
    axes.set_axis_off()
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return axes, np.asarray(canvas.buffer_rgba())[::-1, :, :3] / 255


def seen_at(image, x, y):
    return image[int((y + 4) / 8 * 600), int((x + 3.5) / 8 * 600)]


def door_lines(axes):
    """The leaves that are drawn open, and the arcs of their swing."""
    found = [each for each in axes.collections if isinstance(each, LineCollection)]
    (index,) = (n for n, each in enumerate(found) if each.get_label() == DOOR)
    return found[index].get_segments(), found[index + 1].get_segments()


def test_an_open_doorway_is_a_gap(scene):
    """The lintel of the thick wall is above the section, and would fill it."""
    axes, image = plan_of(house(scene))
    brick = house(scene).materials["brick"].color
    np.testing.assert_allclose(seen_at(image, 3.1, -1.5), brick, atol=0.02)
    np.testing.assert_allclose(seen_at(image, 3.1, 0.5), 1)  # nothing is there: the floor ends at 3
    assert axes.get_legend_handles_labels() == ([], [])


@pytest.mark.parametrize("leaf", [sheet((3.05, 0, 0), (0, 1, 0), (0, 0, 2)), box((3.02, 0.01, 0), (3.08, 0.99, 2))])
def test_a_closed_door_is_drawn_open(scene, leaf):
    axes, image = plan_of(house(scene, leaf))
    np.testing.assert_allclose(seen_at(image, 3.05, 0.2), 1)  # a gap, beside the number in its middle
    (opened,), (arc,) = door_lines(axes)
    np.testing.assert_allclose(opened, [(3.05, 1), (4.05, 1)], atol=0.04)  # out of the room, about the farther end
    np.testing.assert_allclose(np.linalg.norm(arc - opened[0], axis=1), np.ptp(leaf.bounds[:, 1]), atol=0.01)
    np.testing.assert_allclose(arc[[0, -1]], [(3.05, 0), opened[1]], atol=0.04)


def test_a_double_door_has_two_leaves(scene):
    wide = box((3.02, -0.8, 0), (3.08, 1.2, 2))
    leaves = closed_leaves(section(wide, 1), np.array([[[3.0, -3], [3, -0.8]], [[3, 1.2], [3, 3]]]), np.zeros(2))
    assert sorted((*leaf.hinge.round(2), *leaf.opened.round(2)) for leaf in leaves) == [
        (3.05, -0.8, 4.05, -0.8),
        (3.05, 1.2, 4.05, 1.2),
    ]


@pytest.mark.parametrize(
    "other",
    [
        sheet((3.1, 0, 0), (1, 0, 0), (0, 0, 2)),  # stands open in the mesh, too
        union(box((3, 0, 0), (3.2, 0.05, 2)), box((3, 0.95, 0), (3.2, 1, 2))),  # a frame
        sheet((3.05, -2.5, 0), (0, 5, 0), (0, 0, 2)),  # as wide as a wall
        sheet((-1, 0, 0), (0, 1, 0), (0, 0, 2)),  # in the middle of the room
        sheet((3.05, 0, 0), (0, 1, 0), (0, 0, 0.9)),  # below the section
    ],
    ids=["open", "frame", "wide", "alone", "low"],
)
def test_what_is_no_closed_door_is_drawn_where_it_is(scene, other):
    axes, _ = plan_of(house(scene, other))
    assert axes.get_legend_handles_labels() == ([], [])


def test_a_failure_is_one_sentence_and_leaves_no_file(scene, tmp_path, monkeypatch):
    def fail(axes, scene):
        raise ZeroDivisionError("division by zero")

    monkeypatch.setattr(scene_drawing, "draw_view", fail)
    with pytest.raises(DrawingError, match="could not be drawn: ZeroDivisionError: division by zero"):
        draw_scene(scene, tmp_path / "scene.png")
    assert list(tmp_path.iterdir()) == []


def test_the_end_of_the_name_is_the_format(scene, tmp_path):
    draw_scene(scene, tmp_path / "scene.svg")
    assert b"<svg" in (tmp_path / "scene.svg").read_bytes()[:500]
    with pytest.raises(InputError, match="jpg"):
        draw_scene(scene, tmp_path / "scene.jpg")


def test_description_is_json(scene):
    description = json.loads(json.dumps(describe_scene(scene)))
    assert description["frequency"] == 915e6
    assert description["bounds"] == {"min": [-5, -5, 0], "max": [5, 5, 0.3333]}
    assert description["gateway"]["boresight"] == [-1, 0, 0]
    floor, crate = description["objects"]
    assert (floor["material"], floor["thickness"], floor["size"]) == ("concrete", 0.3, [10, 10, 0])
    assert crate["closed"] and crate["triangles"] == 12 and not floor["closed"]
    wood = description["materials"][1]
    assert wood["name"] == "wood" and wood["relative_permittivity"] == pytest.approx(1.99)


@pytest.mark.parametrize("low", [(-1, 0.5, 1), (-1, 0.5, 1.2)], ids=["flat", "line"])
def test_a_region_without_volume_is_drawn(low, scene, tmp_path, recwarn):
    draw_scene(replace(scene, transmitter=Transmitter(low, (1, 0.5, 1.2))), tmp_path / "scene.png")
    assert not [each for each in recwarn if issubclass(each.category, RuntimeWarning)]


def test_a_tall_shaft_is_drawn_with_few_columns(scene, monkeypatch):
    shaft = SceneObject("shaft", box((-1, -1, 0), (1, 1, 100)), "brick")
    there = replace(
        scene,
        objects=(shaft,),
        materials={"brick": p2040_material("brick", 915e6)},
        transmitter=Transmitter((-0.5, -0.5, 1), (0.5, 0.5, 99)),
    )
    pixels = []
    whole = perspective.depth_buffer
    monkeypatch.setattr(perspective, "depth_buffer", lambda *given: pixels.append(whole(*given)) or pixels[-1])
    figure = Figure()
    draw_view(figure.add_subplot(projection="3d"), there)
    assert 1000 < pixels[0].depth.shape[0] <= 4100
