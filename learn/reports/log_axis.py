"""Ticks of a logarithmic axis, at least two of them with labels however little the axis spans."""

from __future__ import annotations

from matplotlib.axis import Axis
from matplotlib.ticker import Locator, LogLocator, MaxNLocator, NullFormatter, StrMethodFormatter


def label_log_axis(axis: Axis) -> None:
    """Choose and label the ticks of a logarithmic axis; call it when everything is drawn.

    Matplotlib labels one or two powers of ten on an axis of two decades, and 2×10², 3×10², … on a shorter one.

    Args:
        axis: the axis, with a logarithmic scale.
    """
    low, high = sorted(axis.get_view_interval())

    def ticks(locator: Locator) -> int:
        return sum(low <= tick <= high for tick in locator.tick_values(low, high))

    if ticks(LogLocator()) > 2:
        return
    subdivided = LogLocator(subs=(1, 2, 5))
    axis.set_major_locator(subdivided if ticks(subdivided) > 2 else MaxNLocator(4, min_n_ticks=2))
    axis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axis.set_minor_formatter(NullFormatter())
