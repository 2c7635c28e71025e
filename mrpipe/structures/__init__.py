"""Mass, damping and stiffness of structures."""
