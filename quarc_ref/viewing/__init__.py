"""Shows streams: renders pictures, and builds a web page that plays a stream."""
