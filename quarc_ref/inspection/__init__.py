"""What a stream holds: summary, chunks, symbols, proof of integrity, decoding speed."""
