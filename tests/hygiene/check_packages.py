#!/usr/bin/env python3
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Checks the groups of deploy/install.sh that the images install against what the programs link: one package too few and
an image doesn't start, one too many and it carries what nobody needs. Exit code 77 if a program isn't built.

    check_packages.py server=build/release/server/ccsliced client=build/release/client/ccslice
"""

import pathlib
import re
import subprocess
import sys

import source_tree

INSTALL = "deploy/install.sh"


def output(*command):
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def listed(group):
    """The packages of a group as the script spells them, those of the groups that it includes too."""
    script = (source_tree.ROOT / INSTALL).read_text(encoding="utf-8")
    entries = re.search(rf"^readonly {group}=\(\n(.*?)^\)", script, re.DOTALL | re.MULTILINE).group(1).split()
    packages = set()
    for entry in entries:
        included = re.fullmatch(r'"\$\{(\w+)\[@\]\}"', entry)
        packages |= listed(included.group(1)) if included else {entry}
    return packages


def linked(program):
    """The packages of the libraries that the program names itself (not those that these libraries name)."""
    libraries = re.findall(r"\(NEEDED\).*\[(.+)\]", output("readelf", "--dynamic", program))
    owners = output("dpkg-query", "--search", *(f"*/x86_64-linux-gnu/{library}" for library in libraries))
    return {owner.split(":")[0] for owner in owners.splitlines()}


def main():
    findings = []
    for argument in sys.argv[1:]:
        group, program = argument.split("=", 1)
        if not pathlib.Path(program).exists():
            print(f"{program} isn't built")
            sys.exit(77)
        names, needs = listed(group), linked(program)
        findings += [f"{INSTALL}: {group} lacks {name}, which {pathlib.Path(program).name} links" for name in sorted(needs - names)]
        findings += [f"{INSTALL}: {group} has {name}, which {pathlib.Path(program).name} doesn't link" for name in sorted(names - needs)]
    source_tree.finish(findings)


main()
