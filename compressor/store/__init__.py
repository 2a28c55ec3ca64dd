"""Outcomes on disk, and back."""
