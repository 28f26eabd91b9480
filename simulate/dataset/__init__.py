"""The NeRF² dataset folder: read it, write it, check it, and complete it with retrieved responses."""
