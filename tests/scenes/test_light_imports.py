"""A place is described without starting the ray tracer, torch or matplotlib."""

import subprocess
import sys


def test_scenes_imports_stay_light():
    code = "import sys, scenes.drawing.scene_drawing, scenes.importing.mesh_import; print('\\n'.join(sys.modules))"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    roots = {line.split(".")[0] for line in loaded.splitlines()}
    assert "scenes" in roots
    assert not roots & {"sionna", "mitsuba", "drjit", "torch", "matplotlib", "simulate", "learn"}
