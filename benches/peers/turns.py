"""Runs a peer's kernel in turns, as studies/src/bin/bench-kernels.rs runs ours: WORKLOAD WIDTHxHEIGHT REPEATS [--step]."""

import sys
import time

import numpy as np


def ramp(width, height):
    """Expected electrons from 10 to 30000, rising from photosite to photosite as in bench-kernels, 32-bit."""
    return np.linspace(10.0, 30_000.0, width * height).reshape(height, width).astype(np.float32)


def codes(plane):
    """The ramp as codes of the default converter."""
    return np.rint(1753 + 0.058824 * plane).clip(0, 4095).astype(np.uint16)


def main(workloads):
    """Makes the workload that the command line names, runs it once uncounted and says `ready`, and then times each repeat;
    with --step it waits for a line on standard input before each. A workload is a function of width and height that gives a
    function without arguments; it is named by a word."""
    words = [word for word in sys.argv[1:] if word != "--step"]
    if len(words) != 3 or words[0] not in workloads:
        sys.exit(f"usage: {sys.argv[0]} {'|'.join(workloads)} WIDTHxHEIGHT REPEATS [--step]")
    width, height = (int(number) for number in words[1].split("x"))
    run = workloads[words[0]](width, height)
    run()
    print("ready", flush=True)
    for _ in range(int(words[2])):
        if "--step" in sys.argv and not sys.stdin.readline():
            break
        cpu, clock = time.process_time(), time.perf_counter()
        run()
        print(f"{time.process_time() - cpu:.6f} {time.perf_counter() - clock:.6f}", flush=True)
