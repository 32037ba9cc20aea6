"""Runs the experiments of the paper on any captures.

    python benchmarks/paper.py CAPTURE... --out DIR [--preset P] [--frames N] [--only full,step]
                               [--workers N | --ray ADDRESS] [--lpips WEIGHTS] [--set KEY=VALUE]

Writes DIR/index.html, CSV, Markdown and plots. Rows and streams are kept in DIR, so that an
interrupted run resumes. Each of several captures has a folder in DIR; a table of all scenes and
their mean is written to DIR/scenes.md and DIR/scenes.csv.
"""

import sys

from paper.command import main

if __name__ == "__main__":
    sys.exit(main())
