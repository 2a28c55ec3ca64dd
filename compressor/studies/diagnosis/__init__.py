"""Which joint is worn, as a sensor's record tells it."""
