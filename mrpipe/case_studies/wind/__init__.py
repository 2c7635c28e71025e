"""76-storey building in wind with damped outriggers (thesis chapter 6)."""
