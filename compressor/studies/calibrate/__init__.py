"""What is not known of a sound machine, fitted to a record of it."""
