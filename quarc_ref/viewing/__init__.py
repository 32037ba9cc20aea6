"""Shows streams: rendered pictures, and a page that plays a stream."""
