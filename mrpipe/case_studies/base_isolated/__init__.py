"""Base-isolated eight-storey building of the ASCE benchmark (thesis chapter 6)."""
