#!/usr/bin/env python3
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Checks that programs have what makes faults hard to abuse and costs nothing: another address at each start, tables of
functions that are read-only from then on (cmake/compile_options.cmake), and stacks that hold no code. Exit code 77 if a
program isn't built.

    check_hardening.py build/release/server/ccsliced build/release/client/ccslice
"""

import pathlib
import re
import subprocess
import sys

import source_tree

# What readelf says of a program -> what is missing otherwise.
WANTED = {
    r"^ +Type: +DYN ": "its address is always the same (-pie)",
    r"^ +GNU_RELRO ": "tables of functions can be written to (-z relro)",
    r"\(FLAGS_1\).*\bNOW\b": "functions are looked up late, so their table can be written to (-z now)",
    r"^ +GNU_STACK .* RW +0x": "stacks can be executed",
}


def described(program):
    # Wide: a line for each thing.
    return subprocess.run(["readelf", "--wide", "--file-header", "--program-headers", "--dynamic", program],
                          check=True, capture_output=True, text=True).stdout


def main():
    findings = []
    for program in sys.argv[1:]:
        if not pathlib.Path(program).exists():
            print(f"{program} isn't built")
            sys.exit(77)
        text = described(program)
        findings += [f"{program}: {fault}" for pattern, fault in WANTED.items() if not re.search(pattern, text, re.MULTILINE)]
    source_tree.finish(findings)


main()
