"""Handles that are dragged on the page of a scene: the lines that it shows give the scene that one sees."""

import re
import shlex

import numpy as np
import pytest
import yaml

from scenes.browser.moved_antennas import MovedAntennas
from scenes.browser.served_page import serving
from scenes.scene.orientation import facing
from scenes.storage.scene_writing import write_scene
from scenes.storage.scene_yaml import load_scene

SOUTH = facing((0, -1, 0))


@pytest.fixture
def shown(scene, join):
    """What the page shows in scene.yaml and as a command after handles were dragged; nothing is written."""

    def open_tab(client):
        MovedAntennas(client, scene)

    with serving("scene", 8680, open_tab) as address, join(address) as tab:
        x, y, z, w = SOUTH
        tab.drag("/handles/gateway", (3.99996, 0.5, 1.25), (w, x, y, z))
        tab.drag("/handles/max", (1.5, -1.5, 1.5))  # over the other corner
        while "-1.5" not in (content := tab.next("GuiUpdateMessage")["updates"].get("_markdown", "")):
            pass
    return re.findall(r"```\n(.*?)\n```", content, re.DOTALL)


def test_lines_give_the_scene_that_is_seen(scene, shown, tmp_path):
    path = write_scene(scene, tmp_path)
    content, lines = yaml.safe_load(path.read_text()), yaml.safe_load(shown[0])
    for part in ("gateway", "transmitter"):
        content[part] |= lines[part]
    path.write_text(yaml.safe_dump(content))
    changed = load_scene(path)
    assert changed.gateway.position == (4.0, 0.5, 1.25)
    np.testing.assert_allclose(changed.gateway.orientation, SOUTH, atol=1e-6)
    np.testing.assert_allclose(changed.transmitter.region, [[-1, -1.5, 0.5], [1.5, -1, 1.5]])


def test_options_are_those_of_the_command(shown):
    words = shlex.split(shown[1].replace("\\\n", ""))
    options = {words[at][2:]: [float(each) for each in words[at + 1 : at + 4]] for at in range(5, len(words), 4)}
    assert words[:5] == ["bisplat", "scene", "FILE", "-o", "FOLDER"]
    assert options["gateway"] == [4.0, 0.5, 1.25] and options["boresight"] == [0, -1, 0]
    assert (options["region-min"], options["region-max"]) == ([-1, -1.5, 0.5], [1.5, -1, 1.5])
