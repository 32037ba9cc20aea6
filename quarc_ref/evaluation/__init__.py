"""Quality of a stream: metrics, sizes and reports, measured on the decoded file."""
