# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0


def broken_rules(rules, subject):
    """What each rule finds wrong, a rule that doesn't find what it looks at included."""
    found = []
    for rule in rules:
        try:
            found += rule(subject)
        except (KeyError, TypeError, AttributeError, IndexError) as missing:
            found.append(f"{rule.__name__} doesn't find what it looks at: {missing!r}")
    return found
