"""The editor's tabs without a browser: what is saved where, and what is never replaced unasked."""

from dataclasses import replace

import pytest

from scenes.browser.scene_editor import Editor
from scenes.browser.served_page import serving
from scenes.files.output_folder import locked
from scenes.storage.scene_yaml import load_scene

PORT = 8680


@pytest.fixture
def edit(scene, tmp_path, join):
    """A tab of the editor that saves to tmp_path/mine, and the Editor."""
    editors = []
    folder = tmp_path / "mine"
    with serving("edit", PORT, lambda client: editors.append(Editor(client, scene, folder))) as address:

        def open_tab():
            tab = join(address)
            tab.next("GuiTextMessage")
            while True:  # the last thing that is built
                if tab.next("GuiButtonMessage")["props"]["label"] == "Replace":
                    return tab, editors[-1]

        yield open_tab


def told(tab) -> tuple[str, str]:
    props = tab.next("NotificationShowMessage")["props"]
    return props["title"], props["body"]


def test_folder_of_the_command_line_is_shown_and_cannot_be_changed(scene, tmp_path, join):
    folder = tmp_path / "a\x1b[2J"
    with serving("edit", PORT, lambda client: [Editor(client, scene, folder)] and None) as address:
        with join(address) as tab:
            shown = tab.next("GuiTextMessage")
    assert shown["value"] == rf"{tmp_path}/a\x1b[2J" and shown["props"]["disabled"]


def test_own_files_are_replaced_without_a_question(edit, tmp_path):
    tab, editor = edit()
    for material in ("wood", "brick", "brick"):
        editor.assign("crate", material)
        tab.press("Save scene.yaml")
        assert told(tab) == ("Saved", str(tmp_path / "mine" / "scene.yaml"))
        assert load_scene(tmp_path / "mine" / "scene.yaml").objects == editor.scene.objects


def test_files_of_others_are_replaced_only_if_the_user_says_so(edit, tmp_path):
    meshes = tmp_path / "mine" / "meshes"
    meshes.mkdir(parents=True)
    (meshes / "floor.ply").write_text("precious")
    tab, editor = edit()
    tab.press("Save scene.yaml")
    title, body = told(tab)
    assert title == "Not saved yet" and "meshes/floor.ply" in body and '"Replace 1 file"' in body
    assert (meshes / "floor.ply").read_text() == "precious" and [*meshes.iterdir()] == [meshes / "floor.ply"]

    (meshes / "floor.ply").write_text("changed meanwhile")
    tab.press("Replace 1 file")
    assert told(tab)[0] == "Not saved yet"
    assert (meshes / "floor.ply").read_text() == "changed meanwhile"
    tab.press("Replace 1 file")
    assert told(tab)[0] == "Saved"
    assert load_scene(tmp_path / "mine" / "scene.yaml") == editor.scene


def test_another_tab_is_another_author(edit, tmp_path):
    first, _ = edit()
    first.press("Save scene.yaml")
    assert told(first)[0] == "Saved"
    second, editor = edit()
    editor.assign("crate", "brick")
    second.press("Save scene.yaml")
    title, body = told(second)
    assert title == "Not saved yet" and "scene.yaml" in body and "meshes" not in body  # the meshes are the same


def test_what_is_refused_is_said_and_the_tab_goes_on(edit, tmp_path):
    tab, editor = edit()
    good = editor.scene
    editor.scene = replace(good, frequency=-1.0)
    tab.press("Save scene.yaml")
    assert "frequency: expected hertz" in told(tab)[1]
    assert not (tmp_path / "mine").exists()
    editor.scene = good
    with locked(tmp_path / "mine"):
        tab.press("Save scene.yaml")
        assert "no other process writes to" in told(tab)[1]
    tab.press("Save scene.yaml")
    assert told(tab)[0] == "Saved"


def test_odd_names_make_a_tab_and_a_folder(scene, tmp_path, join):
    names = ["$\\frac{$", "[/x]", "<img src=x onerror=alert(1)>", "../../a", "a/b", "a/b/c", "/", ".."]
    names.append("x" * 200)
    objects = tuple(replace(scene.objects[0], name=name) for name in names)
    odd, editors = replace(scene, name="../odd [31m", objects=objects), []
    with serving(odd.name, PORT, lambda client: editors.append(Editor(client, odd, tmp_path / "odd"))) as address:
        with join(address) as tab:
            tab.press("Save scene.yaml")
            assert told(tab)[0] == "Saved"
    assert load_scene(tmp_path / "odd" / "scene.yaml").objects == odd.objects
    assert len([*(tmp_path / "odd" / "meshes").iterdir()]) == len(names)
