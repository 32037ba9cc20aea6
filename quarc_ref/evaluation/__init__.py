"""What a stream is worth: metrics, sizes and reports, measured on the decoded file."""
