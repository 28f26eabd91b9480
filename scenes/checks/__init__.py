"""Whether a scene is possible: what is enclosed, what is occupied, and whether the gateway's array is in the open."""
