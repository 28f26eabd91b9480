"""From a dataset and a model to a run folder with weights, resumable."""
