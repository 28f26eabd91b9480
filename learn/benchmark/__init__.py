"""Named benchmark datasets with frozen test parts: what they are, how they are made, and the scores of predictions."""
