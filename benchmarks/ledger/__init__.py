"""What the benchmarks print, and the page that is made of it: results.json, and docs/generated/measurements.md."""
