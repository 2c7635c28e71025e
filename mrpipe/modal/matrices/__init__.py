"""Mass, damping and stiffness from modes: scale, orthogonality, storey models, rigid floors."""
