"""A Ray cluster, or a Ray of our own on this machine."""
