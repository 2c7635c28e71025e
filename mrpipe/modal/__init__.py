"""Modal parameters and matrices of structures from forced, ambient and free-decay tests."""
