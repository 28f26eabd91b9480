"""Many methods on one split: compare, ablate, sweep."""
