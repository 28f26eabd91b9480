"""The gallery of floor plans: a plan for each scene, and one legend for all."""

import pytest
from matplotlib.figure import Figure

from scenes.drawing.scene_drawing import MOST, draw_plans
from scenes.places.random_room import random_room


@pytest.mark.parametrize(("rooms", "plans"), [(1, 1), (7, 7), (MOST + 1, MOST)])
def test_one_plan_for_each_room_and_one_legend(rooms, plans, tmp_path, monkeypatch):
    drawn = []
    saved = Figure.savefig
    monkeypatch.setattr(Figure, "savefig", lambda figure, *args, **options: drawn.append(figure) or b"")
    scenes = {f"room-{number:03d}": random_room(1 + number % 2) for number in range(rooms)}
    draw_plans(scenes, tmp_path / "rooms.png")
    (figure,) = drawn
    assert [axis.get_title() for axis in figure.axes] == list(scenes)[:plans]
    assert not any(text.get_text() for axis in figure.axes for text in axis.texts)  # no numbers without a key
    words = [text.get_text() for text in figure.legends[0].get_texts()]
    materials = {name for scene in scenes.values() for name in scene.materials}
    assert set(words) == materials | {"closed door, drawn open", "transmitter region", "gateway and boresight"}
    if rooms == 1:  # the legend of a single plan is not cut off
        saved(figure, tmp_path / "rooms.png")
        assert figure.legends[0].get_window_extent().x0 >= 0
