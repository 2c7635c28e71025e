"""Plausibility checks, one per module; every module that defines CHECK is used."""
