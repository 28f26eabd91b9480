"""The built-in scenes, with the rooms and furniture that they consist of."""
