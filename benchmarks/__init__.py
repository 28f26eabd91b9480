"""What is measured, one runnable file each: python -m benchmarks.ROOM.NAME --help, from the root of the repository."""
