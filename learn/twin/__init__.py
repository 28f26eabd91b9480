"""Correction of a scene by measurements, and the model that traces the corrected scene."""
