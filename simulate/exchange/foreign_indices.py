"""Read the index files of another program, whose numbers may lack leading zeros or start from 0."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from scenes.files.errors import InputError
from scenes.files.input_file import read_text
from simulate.dataset.index_files import LARGEST_INDEX
from simulate.dataset.picture_files import is_number


def read_indices(source: Path, old_names: Sequence[str]) -> tuple[dict[str, list[str]], list[str]]:
    """The picture names in each index file, none if there are no files; and sentences on what was changed."""
    labels = ("train", "test")
    files = {label: source / f"{label}_index.txt" for label in labels}
    if not all(path.exists() for path in files.values()):
        return {}, [
            "wrote no index files, since the source has none: use the split random (or blocked, from 21 spectra on)"
        ]
    what = "one picture name per line"
    listed = {label: read_text(path, what, LARGEST_INDEX).split() for label, path in files.items()}
    everything = [*listed["train"], *listed["test"]]
    if set(everything) <= set(old_names):
        return listed, []
    if not all(is_number(name) for name in everything):
        raise InputError(f"{files['train']}: expected names or numbers of pictures, found other words")
    numbers = {int(name) for name in everything}
    named = {int(name): name for name in old_names}
    said = "added the leading zeros of the names in the index files"
    if not numbers <= named.keys():  # then they count the pictures
        first = 1 if max(numbers) == len(old_names) else 0
        named = dict(enumerate(old_names, start=first))
        said = f"read the index files as numbers from {first}"
    if not numbers <= named.keys():
        raise InputError(f"{files['train']}: expected numbers of {len(old_names)} pictures, found {max(numbers)}")
    return {label: [named[int(name)] for name in names] for label, names in listed.items()}, [said]
