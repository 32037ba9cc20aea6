"""Real bytes beside the paper's estimate, general compressors and other splat formats.

    python benchmarks/rate.py CAPTURE... [--streams DIR] [--preset P] [--sweep] [--json]

A CAPTURE is a folder, or `synth`: the built-in one, traced as `make demo` has
it. Streams are encoded into DIR unless they are there, so that a run that was
ended goes on where it was. Tables, CSV and plots are written into DIR as well.
"""

from rate.command import main

if __name__ == "__main__":
    main()
