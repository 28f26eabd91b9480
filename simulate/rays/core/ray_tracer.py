"""Dr.Jit, Mitsuba and Sionna RT. Import them from here, since this module first finds a suitable libLLVM."""
# ruff: noqa: E402  (the order matters)

from scenes.files.optional_packages import require_extra
from simulate.rays.core.llvm import use_libllvm

require_extra("rays", "ray tracing")
use_libllvm()

import drjit as dr
import mitsuba as mi
import sionna.rt as rt
import sionna.rt.utils as rt_utils
from sionna.rt.path_solvers.field_calculator import FieldCalculator
from sionna.rt.path_solvers.image_method import ImageMethod
from sionna.rt.path_solvers.paths_buffer import PathsBuffer
from sionna.rt.path_solvers.sb_deterministic import SBDeterministicCandidateGenerator

__all__ = [
    "FieldCalculator",
    "ImageMethod",
    "PathsBuffer",
    "SBDeterministicCandidateGenerator",
    "dr",
    "mi",
    "rt",
    "rt_utils",
]
