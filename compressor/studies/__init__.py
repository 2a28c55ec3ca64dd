"""Studies that are built on the program, a folder each, and what they add to a report.

A study holds all of its own but its verb, which stands in `compsim`: run, file, figures, captions,
section of the page. Nothing of it is imported before it is used.
"""
