"""Design of the control law: the law and gains with the smallest largest response of the real loop."""
