"""An imported scene or converted dataset appears whole, and nothing that was there before is lost."""

import pytest

from scenes.files.errors import InputError
from scenes.files.folder_lock import locked
from scenes.files.output_folder import new_folder


def files(folder) -> dict[str, str]:
    return {str(path.relative_to(folder)): path.read_text() for path in folder.rglob("*") if path.is_file()}


def write(output, force=None) -> None:
    with new_folder(output, force) as folder:
        (folder / "meshes").mkdir()
        (folder / "meshes" / "floor.ply").write_text("new mesh")
        assert not (output / "meshes" / "floor.ply").exists() or force
        (folder / "scene.yaml").write_text("new scene")


WRITTEN = {"meshes/floor.ply": "new mesh", "scene.yaml": "new scene"}


def test_new_and_empty_folders_are_taken_and_nothing_else_is_left(tmp_path):
    (tmp_path / "empty").mkdir()
    for name in ("new", "empty", "deep/new"):
        write(tmp_path / name)
        assert files(tmp_path / name) == WRITTEN
    assert len(files(tmp_path)) == 6


def test_folder_with_files_is_refused_and_with_force_keeps_those_of_other_names(tmp_path):
    (tmp_path / "meshes").mkdir()
    (tmp_path / "meshes" / "floor.ply").write_text("my mesh")
    (tmp_path / "thesis.tex").write_text("precious")
    before = files(tmp_path)
    for force in (False, None):
        with pytest.raises(InputError) as error:
            write(tmp_path, force)
        assert str(error.value).startswith(f"{tmp_path}: ")
        assert ("--force" in str(error.value)) == (force is False)
        assert files(tmp_path) == before
    write(tmp_path, force=True)
    assert files(tmp_path) == {**WRITTEN, "thesis.tex": "precious"}


def test_error_leaves_nothing_and_what_a_killed_process_left_is_removed(tmp_path):
    with pytest.raises(ZeroDivisionError), new_folder(tmp_path / "new") as folder:
        (folder / "half").write_text("")
        raise ZeroDivisionError
    assert not list(tmp_path.iterdir())
    (tmp_path / ".new.unfinished" / "half").mkdir(parents=True)
    write(tmp_path / "new")
    assert files(tmp_path / "new") == WRITTEN and len(list(tmp_path.iterdir())) == 1


def test_second_process_is_refused(tmp_path):
    (tmp_path / ".new.unfinished").mkdir()
    with locked(tmp_path / ".new.unfinished"), pytest.raises(InputError, match="no other process writes to"):
        write(tmp_path / "new")
