"""Settings of an encode: fields, presets and their ranges."""
