"""What the benchmarks print, and the page that is made of it: docs/results.json and docs/measurements.md."""
