"""The NeRF² dataset folder: read, write, check, and complete with retrieved responses."""
