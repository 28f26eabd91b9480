"""From a request to a dataset folder: in parts, on many workers, interruptible at any moment."""
