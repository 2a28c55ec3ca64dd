"""Which joint is worn, by a sensor's record."""
