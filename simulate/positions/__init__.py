"""Where transmitters are: placed in a scene's region, or given by the user."""
