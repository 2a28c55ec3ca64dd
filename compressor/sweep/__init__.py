"""Run the jobs that are missing."""
