"""Native factors, one room for each kind of motion."""
