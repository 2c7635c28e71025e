"""Stages in order, reuse by content, resumption."""
