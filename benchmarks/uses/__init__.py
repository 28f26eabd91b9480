"""How good the uses of a model are: locating, planning, correcting a scene."""
