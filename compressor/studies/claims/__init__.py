"""In which machines the paper's claims hold: over masses, friction, contact and loads."""
