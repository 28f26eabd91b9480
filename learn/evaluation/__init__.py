"""Evaluation of a run: on held-out spectra, against a fresh simulation, and in locating transmitters."""
