"""Ten-storey shear frame with a damper between ground and first floor (paper P4)."""
