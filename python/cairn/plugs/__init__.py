"""Laws and routines of a user's own: compiled, wrapped and plugged in."""
