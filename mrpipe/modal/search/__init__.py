"""Search for the modes of forced tests, and the choice among the poles found."""
