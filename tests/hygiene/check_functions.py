#!/usr/bin/env python3
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Checks that functions have at most 60 lines. It takes the formatter's layout at its word: a function opens with a line
that ends with '{', and is over with the next line that has '}' at the same place. check_tidy.sh asks the compiler, which
takes minutes."""

import re

import source_tree

MOST_LINES = 60
ALLOWED = "NOLINTNEXTLINE(readability-function-size)"
# What else opens with '{' outside of functions.
NO_FUNCTION = re.compile(r"^\s*(namespace|class|struct|union|enum|extern|export|template <[^()]*> (class|struct))\b|=\s*\{$"
                         r"|^\s*\{$|^\s*[\w:<>, ]+\{\{?$|\[[^]]*\]\s*\{$")

CLOSING = re.compile(r" *\}")


def functions(path):
    """(line, number of lines) of each."""
    lines = (source_tree.ROOT / path).read_text(encoding="utf-8").splitlines()
    number = 0
    while number < len(lines):
        line = lines[number]
        indent = line[:len(line) - len(line.lstrip())]
        if line.endswith("{") and ")" in " ".join(lines[max(0, number - 3):number + 1]) and not NO_FUNCTION.search(line):
            end = next((k for k in range(number + 1, len(lines)) if CLOSING.match(lines[k], 0, len(indent) + 1)), number)
            if ALLOWED not in lines[number - 1]:
                yield number + 1, end - number - 1
            number = end
        number += 1


source_tree.finish([f"{path}:{line}: a function of {length} lines, more than {MOST_LINES}"
                    for path in source_tree.files(".h", ".cpp") if path.parts[0] in ("core", "client", "server")
                    for line, length in functions(path) if length > MOST_LINES])
