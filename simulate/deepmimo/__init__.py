"""Scenario folders of DeepMIMO 4: the paths of a simulated dataset, traced again, and its scene."""
