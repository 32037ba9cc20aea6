//! Frames that are written again, byte by byte, and by the steps that an encoder takes.
