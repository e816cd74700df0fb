# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""The options of `ccslice slice` that a job of the farm may have.

A job is written by whoever submits it and runs with a worker's files, certificates and tokens. So only options are let
through that are listed here, none of which names a server, a credential or a file. What isn't listed is refused: an
option that ccslice gets later is refused until somebody lists it."""

import re

VALUE, FLAG = True, False
_MESH = {"--cell-data": VALUE, "--grade": VALUE, "--leave-out": VALUE, "--merge-points": VALUE, "--regions-from": VALUE,
         "--sharp-angle": VALUE, "--size": VALUE, "--units": VALUE, "--allow-folds": FLAG, "--as-meshed": FLAG,
         "--center": FLAG, "--fit": FLAG, "--no-merge": FLAG, "--no-split": FLAG, "--on-bed": FLAG, "--part": FLAG,
         "--sharp-reentrant": FLAG, "--smooth": FLAG}
_GRID = {"--box": VALUE, "--box-voxels": VALUE, "--dpi": VALUE, "--extent": VALUE, "--layer-height": VALUE,
         "--origin": VALUE, "--pitch": VALUE, "--printer": VALUE, "--smallest-feature": VALUE}
_PLACEMENT = {"--at": VALUE, "--overlaps": VALUE, "--rotate": VALUE, "--scale": VALUE, "--translate": VALUE,
              "--snap": FLAG}
_PICTURES = {"--background": VALUE, "--channel": VALUE, "--channel-tolerance": VALUE, "--contour-tolerance": VALUE,
             "--encoding": VALUE, "--flip": VALUE, "--format": VALUE, "--outside": VALUE, "--row-order": VALUE,
             "--all-channels": FLAG, "--cell-regions": FLAG, "--masks": FLAG, "--occupancy": FLAG,
             "--prove-channels": FLAG}
_FIELDS = {"--cut-where": VALUE, "--field": VALUE}
_MATERIALS = {"--density": VALUE, "--halftone": VALUE, "--keep-out": VALUE, "--map": VALUE, "--material": VALUE,
              "--seed": VALUE, "--shell": VALUE, "--strict": FLAG, "--where": VALUE}
_SERVICE = {"--attempts": VALUE, "--patience": VALUE, "--timeout": VALUE, "--quiet": FLAG}
# `ccslice plan` doesn't know these.
_OF_SLICE = {"--contours": VALUE, "--layers": VALUE, "--split": VALUE, "--contours-by-cell-region": FLAG,
             "--no-contact-sheet": FLAG}
KNOWN = {**_MESH, **_GRID, **_PLACEMENT, **_PICTURES, **_FIELDS, **_MATERIALS, **_SERVICE, **_OF_SLICE}
SHORT = {"-q": "--quiet"}

# Refused, with a reason that helps.
REFUSED = {
    **dict.fromkeys(("-o", "--output", "--share", "--resume", "--force", "--json", "-h", "--help"),
                    "is what the farm gives itself, or nothing for it: leave it out"),
    **dict.fromkeys(("--server", "--local", "--no-local", "--ca", "--cert", "--key", "--token-file"),
                    "is for the worker's operator to say (CCSLICE_SERVER, ...): leave it out"),
    **dict.fromkeys(("--allow-includes", "--max-file-bytes"), "is about the worker's files: leave it out"),
    **dict.fromkeys(("--job", "--write-job"), "names a file: give the job's options instead"),
    "--volume": "names a file, which workers don't have: write the values into the mesh as a channel",
    "--sharp-file": "names a file: write the edges into the mesh, ccslice convert MESH --sharp-file FILE -o NEW.ccmesh",
}
_UPLOADED = re.compile(r"sha256:[0-9a-f]{64}")
_GRADE_OF_FILE = re.compile(r"[^=]*=file:")


class OptionRefused(Exception):
    """Says which option it is, and what to do."""


def _checked(name, value):
    """The option as one word, so that ccslice can't take a value for another option."""
    if name in REFUSED:
        raise OptionRefused(f"{name} {REFUSED[name]}")
    if name not in KNOWN:
        raise OptionRefused(f"{name}: jobs of the farm have no such option; deploy/farm/farm_options.py lists them")
    if name == "--grade" and _GRADE_OF_FILE.match(value or ""):
        raise OptionRefused(f"--grade {value} names a file: write the values into the mesh, ccslice convert MESH "
                            f"--grade {value} -o NEW.ccmesh, and submit that")
    return name if value is None else f"{name}={value}"


def parse(words):
    """Returns a command line's options, one word each, of which check() finds nothing wrong."""
    options, rest = [], list(words)
    while rest:
        word = rest.pop(0)
        if not word.startswith("-"):
            options += check([word])
            continue
        name, equals, value = word.partition("=")
        name = SHORT.get(name, name)
        if KNOWN.get(name) == VALUE and not equals:
            if not rest:
                raise OptionRefused(f"{name} needs a value")
            value = rest.pop(0)
        options.append(_checked(name, value if equals or KNOWN.get(name) == VALUE else None))
    return options


def check(options):
    """Returns a job's options, unless they aren't what parse() makes of allowed ones."""
    for word in options:
        name, equals, value = word.partition("=")
        if not word.startswith("-"):
            if not _UPLOADED.fullmatch(word):
                raise OptionRefused(f"{word!r} is no option: a job has one mesh file; other parts of it are ids of "
                                    "uploaded meshes (sha256:...)")
        elif _checked(name, value if equals else None) and KNOWN[name] == VALUE and not equals:
            raise OptionRefused(f"{name} needs a value")
    return options


def value_of(options, wanted):
    """The last value that the option has, or None."""
    values = [word.partition("=")[2] for word in options if word.partition("=")[0] == wanted]
    return values[-1] if values else None


def of_plan(options):
    """Those that `ccslice plan` takes, too."""
    return [word for word in options if word.partition("=")[0] not in _OF_SLICE]
