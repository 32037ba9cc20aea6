"""Compares the size of streams with the paper's estimate, compressors and other splat formats.

    python benchmarks/rate.py CAPTURE... [--streams DIR] [--preset P] [--sweep] [--json]

A CAPTURE is a folder, or `synth` for the built-in capture of `make demo`. Streams are encoded into
DIR unless they exist, so that an interrupted run resumes. Tables, CSV and plots are written into
DIR as well.
"""

from rate.command import main

if __name__ == "__main__":
    main()
