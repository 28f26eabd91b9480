"""A scene corrected by measurements, and the model that traces it."""
