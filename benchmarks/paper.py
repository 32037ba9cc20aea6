"""The paper's experiments on any captures, by one command.

    python benchmarks/paper.py CAPTURE... --out DIR [--preset P] [--frames N] [--only full,step]
                               [--workers N | --ray ADDRESS] [--lpips WEIGHTS] [--set KEY=VALUE]

Writes DIR/index.html, CSV, Markdown and plots; rows and streams are kept in DIR, so
that a run that was ended goes on where it was. Several captures have a folder each in
DIR, and a table of all scenes and their mean, DIR/scenes.md and DIR/scenes.csv.
"""

import sys

from paper.command import main

if __name__ == "__main__":
    sys.exit(main())
