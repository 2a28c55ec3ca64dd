"""A YAML text -> checked cases and studies."""
