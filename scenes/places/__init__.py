"""The built-in places, and the furniture and room shells that they are built of."""
