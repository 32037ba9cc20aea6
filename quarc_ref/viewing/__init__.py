"""A stream to look at: pictures of its cameras, and a page that plays it."""
