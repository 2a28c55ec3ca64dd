"""Words that several captions are made of."""


def plural(count: int, thing: str) -> str:
    """Return a number of things in words."""
    return f"{count} {thing}" + ("s" if count != 1 else "")
