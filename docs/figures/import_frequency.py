"""Numbers that are taken as hertz, and numbers that are refused with a hint."""

import matplotlib.pyplot as plt

from scenes.files.errors import ParameterError
from scenes.scene.frequency import HIGHEST_FREQUENCY, LOWEST_FREQUENCY, read_frequency

figure, axis = plt.subplots(figsize=(8, 2.2), layout="constrained")
axis.axvspan(LOWEST_FREQUENCY, HIGHEST_FREQUENCY, color="tab:green", alpha=0.2)
axis.text(1e9, 0.87, "taken as hertz", color="tab:green", ha="center")
axis.text(1e3, 0.87, "refused", color="tab:red", ha="center")
for text, height in (("2.4", 0.65), ("60", 0.15), ("915", 0.65), ("3500", 0.4), ("915e6", 0.65), ("28e9", 0.4)):
    try:
        read_frequency(text)
        label, color = text, "tab:green"
    except ParameterError as error:
        label, color = f"{text}: {error.message.split('; ')[1]}", "tab:red"
    axis.plot(float(text), height, "o", color=color)
    axis.annotate(label, (float(text), height), (5, 0), textcoords="offset points", va="center", fontsize=8)
axis.set(xscale="log", xlim=(1, 1e13), ylim=(0, 1), yticks=[], xlabel="number without a unit")
