"""The trade of speed for accuracy, and the extremes."""
