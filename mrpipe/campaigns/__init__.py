"""Measured campaigns."""
