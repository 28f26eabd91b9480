"""The colours of spectra, the same in figures, reports and the viewer. Perceptually uniform; the phase's are cyclic."""

MAGNITUDE = "viridis"
DIFFERENCE = "RdBu_r"
PHASE = "twilight"
LEAST_DB = -30.0
"""Where decibels below a spectrum's maximum end."""
