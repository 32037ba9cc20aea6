"""Generates the test vectors of conformance/, which the modules in making/ define as Python code.

    python conformance/generate.py            write what differs, delete what is not generated
    python conformance/generate.py --check    write nothing; fail if anything differs

The output is deterministic: it is computed without training, torch or random numbers.
Released streams never change; to test another fault, add a new stream.
"""

import argparse
import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).resolve().parent), str(Path(__file__).resolve().parents[1])]

from making.suite import make_suite  # noqa: E402, the path is set above
from making.writing_files import list_differing_files, write_files  # noqa: E402


def main() -> int:
    """Write the suite or, with `--check`, compare it with the files; return the exit status."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--check", action="store_true", help="write nothing; fail if a file differs"
    )
    parser.add_argument("--output", type=Path, default=Path(__file__).resolve().parent)
    options = parser.parse_args()
    files = make_suite()
    differing_names = list_differing_files(files, options.output)
    if not options.check:
        write_files(files, differing_names, options.output)
    for name in differing_names:
        action = "differs" if options.check else "written" if name in files else "deleted"
        print(f"{action}: {name}")
    byte_count = sum(map(len, files.values()))
    print(f"{len(files)} files, {byte_count:,} bytes, {len(differing_names)} differ")
    return int(options.check and bool(differing_names))


if __name__ == "__main__":
    sys.exit(main())
