"""Support for parallel work: compiled kernels in threads, and other machines."""
