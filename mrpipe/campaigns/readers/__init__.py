"""Readers of data files: one module for each format, which defines READER and is found by itself."""
