"""Engines: how responses are simulated, each one object, and the table of them."""
