"""Tests a decoder or an encoder with the vectors of conformance/.

    python conformance/run.py --decoder "python -m quarc_ref.conformance"
    python conformance/run.py --decoder "./mydecoder" --only invalid/ --json report.json

The runner needs only Python 3.11 or later. README.md is the introduction; RUNNER.md describes how
the runner calls decoders and encoders.
"""

import argparse
import math
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

from runner.case_runner import CaseRunner, query_capabilities
from runner.cases import list_cases, list_tested_capabilities
from runner.encoders import make_encoder_case, try_encoder
from runner.limits import Limits
from runner.manifest import Suite, SuiteError
from runner.process import StartError
from runner.report import Report, Result, select_cases, write_reports

_FOLDER = Path(__file__).resolve().parent
_EXIT_FAILED, _EXIT_NOT_RUN = 1, 2


def main() -> int:
    """Return 0 if all cases passed, 1 if any failed, 2 if none ran or a file cannot be written."""
    options = parse_arguments()
    limits = Limits(options.timeout, options.memory)
    try:
        if options.write is not None:
            return write_streams(Suite.load(options.suite), options.write)
        run_cases = run_suite if options.encoder is None else run_scenes
        report = run_cases(options, limits)
        sys.stdout.write(report.as_text(clauses=options.clauses))
        write_reports(report, options.json, options.junit)
    except (SuiteError, StartError, OSError) as error:
        print(f"run.py: {error}", file=sys.stderr)
        return _EXIT_NOT_RUN
    return 0 if report.passed else _EXIT_FAILED


def parse_arguments() -> argparse.Namespace:
    """Return the options of the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    mode_group = parser.add_mutually_exclusive_group(required=True)
    mode_group.add_argument("--decoder", help="command of the decoder, in shell syntax")
    parser.add_argument(
        "--encoder", help="command of an encoder to test; --decoder decodes its streams"
    )
    mode_group.add_argument(
        "--write",
        type=Path,
        metavar="DIR",
        help="write all streams of the suite as files to this folder",
    )
    parser.add_argument("--suite", type=Path, default=_FOLDER, help="folder of the suite")
    parser.add_argument(
        "--only",
        action="append",
        default=[],
        help="run only the cases whose names begin with this prefix; may be repeated",
    )
    parser.add_argument(
        "--timeout", type=parse_limit, default=10.0, help="time limit of a case, in s (default: 10)"
    )
    parser.add_argument(
        "--memory", type=parse_limit, default=512.0, help="memory limit, in MiB (default: 512)"
    )
    parser.add_argument(
        "--alone",
        action="store_true",
        help="start a new process for each stream, even if the decoder supports jobs; capabilities"
        " that require jobs are not tested",
    )
    parser.add_argument(
        "--clauses", action="store_true", help="add the results of each clause to the text report"
    )
    parser.add_argument("--json", type=Path, help="write a JSON report to this file")
    parser.add_argument("--junit", type=Path, help="write a JUnit report to this file")
    return parser.parse_args()


def parse_limit(text: str) -> float:
    """Return a limit, which is a finite number of seconds or MiB above 0."""
    try:
        limit = float(text)
    except ValueError:
        limit = math.nan
    if not 0 < limit < math.inf:
        message = f"{text} is not a finite number above 0"
        raise argparse.ArgumentTypeError(message)
    return limit


def run_suite(options: argparse.Namespace, limits: Limits) -> Report:
    """Run the cases that the decoder supports and that `--only` selects."""
    suite = Suite.load(options.suite)
    capabilities = query_capabilities(options.decoder, limits)
    has_jobs = "jobs" in capabilities.get("capabilities", []) and not options.alone
    capabilities = list_tested_capabilities(capabilities, with_jobs=has_jobs)
    cases = select_cases(list_cases(suite, capabilities), options.only)
    case_runner = CaseRunner(options.decoder, suite, limits, supports_jobs=has_jobs)
    results = []
    try:
        for case in cases:
            start = time.monotonic()
            verdict = case_runner.run_case(case)
            results.append(Result(case, verdict, time.monotonic() - start))
    finally:
        case_runner.close()
    return Report(options.decoder, capabilities, results)


def run_scenes(options: argparse.Namespace, limits: Limits) -> Report:
    """Test an encoder with every scene of the suite."""
    scenes = sorted((options.suite / "encoder").glob("*.json"))
    if not scenes:
        message = f"{options.suite / 'encoder'} contains no scenes"
        raise SuiteError(message)
    results = []
    for case in select_cases(map(make_encoder_case, scenes), options.only):
        start = time.monotonic()
        scene = options.suite / f"{case.name}.json"
        verdict = try_encoder(options.encoder, options.decoder, scene, limits)
        results.append(Result(case, verdict, time.monotonic() - start))
    return Report(options.encoder, {}, results, tool="encoder")


def write_streams(suite: Suite, folder: Path) -> int:
    """Write every stream of a suite, including those that are generated on demand."""
    for name in suite.vectors:
        path = folder / f"{name}.quarc"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(suite.read_stream(name))
    print(f"{len(suite.vectors)} streams written to {folder}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
