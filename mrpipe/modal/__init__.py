"""Modal parameters from measured frequency responses and decays."""
