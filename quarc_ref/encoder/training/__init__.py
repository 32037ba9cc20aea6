"""Training of Gaussians: losses, views, density and the canonical frame."""
