"""From a request to a dataset folder, in parts, on many workers, and interruptible at any moment."""
