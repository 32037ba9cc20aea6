"""Settings of an encode: fields, valid ranges and presets."""
