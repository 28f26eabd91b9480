"""What work in parallel needs: a lock for kernels in threads, and a Ray cluster."""
