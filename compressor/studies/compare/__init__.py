"""A measured record beside simulated ones: how alike they are, and what does not fit."""
