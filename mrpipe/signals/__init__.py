"""Filtering, offsets, differentiation, cycles."""
