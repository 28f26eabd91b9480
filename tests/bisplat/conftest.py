"""The folders, runs and scenes that tests of the commands share with those of the rooms below."""

from tests.learn.conftest import (  # noqa: F401
    changed,
    finished_run,
    no_ceiling,
    one_thread,
    plane_waves,
    region,
    small,
    small_aperture,
    small_models,
    tiny,
    tiny_config,
    write_folder,
)
from tests.simulate.conftest import floor, make_scene  # noqa: F401
