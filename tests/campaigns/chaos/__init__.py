"""Fault injection: what must survive, tried many times."""
