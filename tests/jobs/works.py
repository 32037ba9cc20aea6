"""Jobs for the tests, which worker processes import by name."""

import os
import signal
import time
from multiprocessing.connection import Connection
from pathlib import Path


def square(number):
    return number * number


def square_slowly(number):
    """Return a square and the worker, but only after another worker has had time to start."""
    time.sleep(0.5)
    return number * number, os.getpid()


def fail_if_odd(number):
    if number % 2:
        message = f"{number} is odd"
        raise ValueError(message)
    return number


def name_processes(_argument):
    """Return the ids of this process and of its parent."""
    return os.getpid(), os.getppid()


def name_threads(_argument):
    import numba

    return numba.config.NUMBA_NUM_THREADS, os.environ["OMP_NUM_THREADS"]


def is_interrupt_blocked(_argument):
    return signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, [])


def kill_self_if_odd(number):
    """Die like a process killed for lack of memory."""
    if number % 2:
        os.kill(os.getpid(), signal.SIGKILL)
    return number


def die_while_sending_if_odd(number):
    """Die after the first bytes of the result have been sent."""

    def send_a_part(connection, message, *_):
        os.write(connection.fileno(), bytes(message[:9]))
        os.kill(os.getpid(), signal.SIGKILL)

    if number % 2:
        Connection._send = send_a_part
    return number


def return_no_value(_argument):
    return lambda: None


def sleep_with_file(path):
    """Report by a file that the job runs; without a path, do nothing."""
    while path:
        Path(path).write_text(f"{os.getpid()} {time.monotonic()}")
        time.sleep(0.02)


def sleep_until_interrupted(path):
    """Report that the job runs, and its interruption; without a path, do nothing."""
    if path is None:
        return
    Path(path).write_text("runs")
    try:
        time.sleep(60)
    except KeyboardInterrupt:
        Path(path).write_text("interrupted")
        raise
