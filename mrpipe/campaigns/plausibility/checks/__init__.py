"""One plausibility check in each module; a module that defines CHECK is found by itself."""
