"""From residual to effect."""
