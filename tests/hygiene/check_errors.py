#!/usr/bin/env python3
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Checks the contract's table of errors against the code: every code of ours that can reach a client has one reason of
the same number and name in errors.proto, no two share one, each has a comment, and the reasons that other parts of the
contract name exist, and service.proto names every reason of a request or of the service at a call that gives it."""

import pathlib
import re

import source_tree

ERRORS = pathlib.Path("proto/ccslice/v1/errors.proto")
SERVICE = ERRORS.with_name("service.proto")
PREFIX = "ERROR_REASON_"
VALUE = re.compile(r"^\s*" + PREFIX + r"(\w+) = (\d+);")
CODE = re.compile(r"^\s*k(\w+) = (\d+),")
NAMED = re.compile(r"\b(?:INVALID_ARGUMENT|OUT_OF_RANGE|FAILED_PRECONDITION|RESOURCE_EXHAUSTED|UNAVAILABLE), ([A-Z_]+)\b")


def documented():
    """Number -> (name, has a comment right above)."""
    values, above = {}, ""
    for _, text in source_tree.lines(ERRORS):
        match = VALUE.match(text)
        if match and int(match.group(2)):
            values[int(match.group(2))] = (match.group(1), above.strip().startswith("//"))
        above = text
    return values


def codes():
    """Number -> name of the codes that reach clients: not those of files (4xx)."""
    found = {}
    for header in ("core/base/error.h", "server/service/base/service_error.h"):
        for _, text in source_tree.lines(pathlib.Path(header)):
            match = CODE.match(text)
            if match and int(match.group(2)) // 100 != 4:
                found[int(match.group(2))] = re.sub(r"(?<!^)(?=[A-Z])", "_", match.group(1)).upper()
    return found


def main():
    reasons, ours = documented(), codes()
    findings = [f"{ERRORS}: no reason {number} {name}" for number, name in ours.items() if number not in reasons]
    for number, (name, commented) in reasons.items():
        if ours.get(number) != name:
            findings.append(f"{ERRORS}: {name} = {number} belongs to no code of that name")
        if not commented:
            findings.append(f"{ERRORS}: {name} has no comment")
    calls = "".join(text for _, text in source_tree.lines(SERVICE))
    for number, (name, _) in reasons.items():
        family = name.split("_")[0] + "_*"  # Such as PLACEMENT_*.
        if number // 100 in (2, 5) and not re.search(rf"\b{name}\b", calls) and family not in calls:
            findings.append(f"{SERVICE}: no call names {name}")
    names = [name for name, _ in reasons.values()]
    findings += [f"{ERRORS}: {name} is there twice" for name in set(names) if names.count(name) > 1]
    for path in source_tree.files(".proto", under=ERRORS.parent):
        for line, text in source_tree.lines(path):
            for name in NAMED.findall(text):
                if not name.endswith("_") and name not in names:
                    findings.append(f"{path}:{line}: {name} is no reason of {ERRORS.name}")
    source_tree.finish(findings)


main()
