"""Localisation of a transmitter from its spectrum."""
