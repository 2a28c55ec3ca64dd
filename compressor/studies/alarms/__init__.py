"""Which alarm sees wear first, by joint and clearance, and how often it is false."""
