"""Bores that wear over operating hours, until a joint is worn out."""
