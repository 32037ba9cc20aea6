"""Compares the size of streams with the paper's estimate, compressors and other splat formats.

    python benchmarks/rate.py CAPTURE... [--streams DIR] [--preset P] [--sweep] [--json]

CAPTURE is the folder of a capture, or `synth` for the playroom of `make demo`. Streams that
are not yet in DIR are encoded and saved there, so the same command resumes an interrupted run.
Tables (Markdown, CSV) and plots are also written to DIR.
"""

from expected_errors import report_errors
from rate.command import main

if __name__ == "__main__":
    with report_errors():
        main()
