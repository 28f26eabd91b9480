"""A method that is fitted to the received powers of a folder, and the maps that it predicts."""
