"""A store -> figures and a page."""
