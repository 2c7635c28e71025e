"""Design of the control law: the law and gains whose largest response in the real loop is smallest."""
