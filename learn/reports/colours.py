"""Matplotlib's colour maps for spectra, the same in figures, reports and the viewer.

All are perceptually uniform, and the one for phases is cyclic.
"""

MAGNITUDE = "viridis"
DIFFERENCE = "RdBu_r"
PHASE = "twilight"
LEAST_DB = -30.0
"""Lower end of the scale in decibels, dB relative to the spectrum's maximum."""
