"""Laws of frequency and damping over amplitude."""
