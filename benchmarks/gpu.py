"""All that needs a CUDA GPU, in ten minutes at most, in one table.

    python benchmarks/gpu.py --out DIR [--wheels DIR] [--minutes M] [--dry-run]
    python benchmarks/gpu.py --fetch DIR [--python 3.12]

The first writes `gpu.md` and `gpu.json` into DIR, anew after every step: a run that is
interrupted leaves the table of what was done. A step that fails or takes too long is a
row that says why. `--dry-run` goes through all of it on the CPU, in tiny sizes.

Where the machine with the GPU lacks packages and has no network, fetch their wheels
elsewhere with the second form, for the machine's version of Python, and carry the folder
over. `--wheels` installs those that are missing into a folder in it, for this command alone.
"""

from gpu.command import main

if __name__ == "__main__":
    raise SystemExit(main())
