"""Interpolation of responses and spectra between known positions: kriging under the Helmholtz equation."""
