"""A frequency is read with its unit, and a number in megahertz or gigahertz is refused with the hertz to write."""

from dataclasses import replace

import numpy as np
import pytest

from scenes.checks.validation import validate
from scenes.files.errors import InputError, ParameterError
from scenes.places.built_in import closet
from scenes.scene.frequency import read_frequency
from scenes.scene.materials import p2040_materials

READ = [
    *((915e6, 915e6), (np.float32(915e6), 915e6), (10**9, 1e9), ("915e6", 915e6), ("915 MHz", 915e6)),
    *((" 915mhz ", 915e6), ("0.915 GHz", 915e6), ("3.5GHz", 3.5e9), ("915000 kHz", 915e6), ("9.15e8 Hz", 915e6)),
]


@pytest.mark.parametrize(("given", "hertz"), READ)
def test_units(given, hertz):
    assert read_frequency(given) == pytest.approx(hertz, rel=1e-12)


MEANT = [
    *(("915", "915 MHz are 915e6"), (2.4, "2.4 GHz are 2.4e9"), (915000, "915000 kHz are 915000e3")),
    (60, "60 MHz are 60e6, 60 GHz are 60e9"),  # both are bands in use
]


@pytest.mark.parametrize(("given", "hint"), MEANT)
def test_other_units_are_recognised_and_the_advice_works(given, hint):
    with pytest.raises(ParameterError, match=f"^frequency: expected hertz, .*; {hint}$"):
        read_frequency(given)
    for advice in hint.split(", "):
        text, number = advice.split(" are ")
        assert read_frequency(number) == read_frequency(text)


NONE = [0, -915e6, 1e13, 10**400, float("nan"), float("inf"), "nan", "9e999", "", "MHz", "5000 GHz", "915 MHzz"]


@pytest.mark.parametrize("given", [*NONE, "1_0 GHz", "１ GHz", "9" * 400, True, None, [915e6], 1e9 + 0j])
def test_what_is_no_frequency(given):
    with pytest.raises(ParameterError, match=r"^frequency: expected hertz, from 1e6 to 1e12, .*, found [^;]*$"):
        read_frequency(given)


def test_gigahertz_given_to_python_are_recognised():
    with pytest.raises(InputError, match=r"frequency: expected hertz, .* found 2.4; 2.4 GHz are 2.4e9"):
        p2040_materials(["concrete"], 2.4)
    with pytest.raises(InputError, match=r"closet: frequency: expected a number of hertz, found '915 MHz'"):
        validate(replace(closet(), frequency="915 MHz"), "closet")
