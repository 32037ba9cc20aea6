"""Training of the frames after a canonical one: motion, updates, births, rate control."""
