"""The command line of compsim."""
